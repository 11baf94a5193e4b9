// watch: creations, changes, and deletions of hulls; begin and end of collisions of pairs.
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/scene/scene_file.h"

namespace hulld {
namespace {

struct WatchOptions {
  std::string prefix;
  bool exact = false;
  // A file. Empty: watches hulls.
  std::string scene;
  bool until_synced = false;
  // 0: unlimited.
  uint64_t events = 0;
};

std::string KindText(v1::HullEventKind kind) {
  return std::string(absl::StripPrefix(v1::HullEventKind_Name(kind), "HULL_EVENT_KIND_"));
}

std::string KindText(v1::CollisionEventKind kind) {
  return std::string(absl::StripPrefix(v1::CollisionEventKind_Name(kind), "COLLISION_EVENT_KIND_"));
}

std::string EventText(const v1::HullEvent& event) {
  const v1::HullInfo& hull = event.hull();
  std::string text =
      absl::StrCat(KindText(event.kind()), "\t", hull.hull_id(), "\t", hull.revision());
  if (event.is_body()) text += "\tbody";
  if (event.kind() == v1::HULL_EVENT_KIND_DELETED) return text;
  if (hull.damaged()) return text + "\tdamaged";
  if (event.is_body()) {
    return absl::StrCat(text, " of ", event.piece_count(),
                        event.piece_count() == 1 ? " piece" : " pieces");
  }
  absl::StrAppend(&text, "\t", hull.vertex_count(), " of ", hull.counts().received(), " points");
  if (!event.has_box_min()) return text;
  return absl::StrCat(text, "\t", VectorText(event.box_min()), " to ", VectorText(event.box_max()));
}

void PrintHullEvents(const v1::WatchHullsResponse& message, const Invocation& run) {
  if (message.restarted()) run.out << "# restart: discard the lines above\n";
  for (const v1::HullEvent& event : message.events()) {
    run.out << (run.names() ? event.hull().hull_id() : EventText(event)) << "\n";
  }
  if (message.synced()) run.out << "# synced at revision " << message.header().revision() << "\n";
}

// Prints messages until the watch ends, the callback returns true, the output fails, or Ctrl-C.
// Returns the error that ended the watch.
template <typename Watch, typename Print>
absl::Status PrintAll(const Invocation& run, const std::unique_ptr<Watch> watch,
                      const Print& print) {
  std::atomic<bool> is_interrupted = false;
  // Destroyed before the watch that it calls.
  const Interrupt interrupt([&] {
    is_interrupted = true;
    watch->Cancel();
  });
  while (true) {
    const auto message = watch->Next();
    if (!message.ok()) return is_interrupted ? absl::OkStatus() : message.status();
    if (run.json()) run.out << MessageJson(*message) << "\n";
    const bool is_enough = print(*message);
    run.out << std::flush;
    if (is_enough || !run.out) return absl::OkStatus();
  }
}

ExitCode WatchHulls(const Invocation& run, const WatchOptions& options) {
  v1::WatchHullsRequest request;
  (options.exact ? request.mutable_hull_id() : request.mutable_prefix())->assign(options.prefix);
  request.set_bodies(true);
  uint64_t events = 0;
  const auto print = [&](const v1::WatchHullsResponse& message) {
    if (!run.json()) PrintHullEvents(message, run);
    events += static_cast<uint64_t>(message.events_size());
    return (options.events > 0 && events >= options.events) ||
           (options.until_synced && message.synced());
  };
  const absl::Status status = PrintAll(run, run.MakeClient().WatchHulls(request), print);
  return status.ok() ? ExitCode::kDone : run.Fail(status);
}

// Returns the watch of a scene with fixed poses.
v1::CollisionWatchOpen OpenOf(const Scene& scene) {
  const v1::FindCollisionsRequest& request = scene.request;
  v1::CollisionWatchOpen open;
  *open.mutable_placements() = request.placements();
  *open.mutable_packed_placements() = request.packed_placements();
  if (request.wanted().has_clearance()) open.set_clearance(request.wanted().clearance());
  if (scene.pairs.has_value()) {
    open.mutable_pairs()->Assign(scene.pairs->begin(), scene.pairs->end());
    return open;
  }
  *open.mutable_groups() = request.groups();
  open.set_ignore_same_group(request.ignore_same_group());
  *open.mutable_ignored_group_pairs() = request.ignored_group_pairs();
  if (request.has_movers()) open.set_movers(request.movers());
  return open;
}

// Returns the deciding pieces of bodies; empty if none decided.
std::string DecidingPieces(const Scene& scene, const v1::CollisionEvent& event) {
  if (!event.has_piece_a() && !event.has_piece_b()) return "";
  const auto index = [](bool has, const v1::DecidingPiece& piece) {
    return has ? static_cast<int32_t>(piece.index()) : -1;
  };
  const std::pair pieces(index(event.has_piece_a(), event.piece_a()),
                         index(event.has_piece_b(), event.piece_b()));
  return PiecesText(pieces, scene.NamesOfPieces(event.placement_a(), event.placement_b(), pieces));
}

ExitCode WatchScene(const Invocation& run, const WatchOptions& options) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto scene, ReadWholeScene(options.scene, "watch"));
  uint64_t events = 0;
  bool is_synced = false;
  const auto print = [&](const v1::WatchCollisionsResponse& message) {
    for (const v1::PlacementProblem& problem : message.placement_problems()) {
      run.err << "hullctl: placement " << scene.NameOf(problem.placement()) << ": "
              << scene.ProblemText(problem.placement(), problem) << "\n";
    }
    for (const v1::CollisionEvent& event : message.events()) {
      if (run.json()) break;
      run.out << KindText(event.kind()) << "\t" << scene.NameOf(event.placement_a()) << "\t"
              << scene.NameOf(event.placement_b());
      if (event.kind() != v1::COLLISION_EVENT_KIND_LOST) {
        run.out << "\t" << event.revision_a() << "\t" << event.revision_b();
      }
      const auto pieces = DecidingPieces(scene, event);
      if (!pieces.empty()) run.out << "\t" << pieces;
      run.out << "\n";
    }
    const bool was_synced = std::exchange(is_synced, is_synced || message.synced());
    if (is_synced && !was_synced && !run.json()) {
      run.out << "# synced at revision " << message.header().revision() << "\n";
    }
    events += static_cast<uint64_t>(message.events_size());
    return (options.events > 0 && events >= options.events) || (options.until_synced && is_synced);
  };
  const absl::Status status = PrintAll(run, run.MakeClient().WatchCollisions(OpenOf(scene)), print);
  return status.ok() ? ExitCode::kDone : run.Fail(scene.InKeys(status));
}

}  // namespace

void AddWatchCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<WatchOptions>();
  Command command =
      program.AddCommand("watch", "Print changes of hulls, or of the pairs of a scene");
  command.AddText("PREFIX", &options->prefix, "Only hulls and bodies with this prefix")
      .Completes(ValueKind::kPlaced);
  command.AddFlag("--exact", &options->exact, "Only the hull with exactly this ID");
  command
      .AddText("--scene", &options->scene,
               "Watch the pairs of a scene instead: print collisions that begin and end")
      .ValueName("FILE");
  command.AddFlag("--until-synced", &options->until_synced, "Exit after the initial state");
  command.AddNumber("--events", 1, kAnyNumber,
                    "Exit after N events, or slightly more if several arrive together",
                    &options->events);
  command.SetDetails(
      "Prints one line per event: kind, ID, revision, vertices and points, and box; for a body,\n"
      "its number of pieces. The initial state comes first (PRESENT) and ends with a line\n"
      "'# synced'. Then come CREATED, CHANGED, REPLACED, and DELETED. If a hull changes\n"
      "several times before it is printed, only its last state is. If the pending changes take\n"
      "several messages, the hulls are printed as PRESENT.\n"
      "With --scene: kind (ENTER, TOUCH, EXIT; with a clearance, NEAR and FAR; LOST if a hull is\n"
      "deleted), the two placements, the revisions of their hulls or bodies, and, for bodies, the\n"
      "deciding pieces. Poses are fixed; pairs change as hulls grow and bodies are replaced.\n"
      "A watch that loses the server reconnects within --timeout and resumes.\n"
      "With --output json, each message of the contract is one line; 'hullctl view --recording'\n"
      "plays such a file. Ctrl-C ends the watch.");
  command.SetExamples(
      {{"Hulls of one cell", "hullctl watch cell-3/"},
       {"The current state, for a script", "hullctl watch --until-synced --output json"},
       {"Collisions while hulls grow", "hullctl watch --scene scene.yaml"},
       {"Record them, to play them later",
        "hullctl watch --scene scene.yaml --output json > watch.jsonl"}});
  command.OnGiven([=] {
    invocation->action = [=] {
      const Invocation& run = *invocation;
      if (options->scene.empty()) return WatchHulls(run, *options);
      if (options->prefix.empty() && !options->exact) return WatchScene(run, *options);
      return run.FailUsage("--scene cannot be combined with PREFIX or --exact");
    };
  });
}

}  // namespace hulld
