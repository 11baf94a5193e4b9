// watch: hulls as they come, change and go; pairs as they begin and end to collide.
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/batch_file.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

struct WatchOptions {
  std::string prefix;
  bool exact = false;
  // A file; empty: hulls are watched.
  std::string scene;
  bool until_synced = false;
  // 0: no end.
  uint64_t events = 0;
};

std::string CornerText(const v1::Vector3& p) {
  return absl::StrCat(ShortestText(p.x()), " ", ShortestText(p.y()), " ", ShortestText(p.z()));
}

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
  if (event.kind() == v1::HULL_EVENT_KIND_DELETED) return text;
  if (hull.damaged()) return text + "\tdamaged";
  absl::StrAppend(&text, "\t", hull.vertex_count(), " of ", hull.counts().received(), " points");
  if (!event.has_box_min()) return text;
  return absl::StrCat(text, "\t", CornerText(event.box_min()), " to ", CornerText(event.box_max()));
}

void Print(const v1::WatchHullsResponse& message, std::ostream& out) {
  if (message.anew()) out << "# anew: forget what is above\n";
  for (const v1::HullEvent& event : message.events()) out << EventText(event) << "\n";
  if (message.synced()) out << "# synced at revision " << message.header().revision() << "\n";
}

// Ends a watch at Ctrl-C.
template <typename Watch>
class Ending {
 public:
  // `start` starts the watch, whose threads do not take the signal.
  explicit Ending(const std::function<std::unique_ptr<Watch>()>& start)
      : interrupt_([this] { End(); }), watch_(start()) {
    const std::lock_guard lock(mutex_);
    is_started_ = true;
    if (is_ended_) watch_->Cancel();
  }

  Watch& watch() { return *watch_; }
  bool is_ended() {
    const std::lock_guard lock(mutex_);
    return is_ended_;
  }

 private:
  void End() {
    const std::lock_guard lock(mutex_);
    is_ended_ = true;
    if (is_started_) watch_->Cancel();
  }

  std::mutex mutex_;
  bool is_started_ = false;
  bool is_ended_ = false;
  const Interrupt interrupt_;
  const std::unique_ptr<Watch> watch_;
};

// Prints what comes until the watch ends, `print` says that it is enough, or Ctrl-C.
template <typename Watch, typename Print>
ExitCode PrintAll(const Invocation& run, Ending<Watch>& ending, const Print& print) {
  while (true) {
    const auto message = ending.watch().Next();
    if (!message.ok()) return ending.is_ended() ? ExitCode::kDone : run.Fail(message.status());
    if (run.json) {
      run.out << MessageJson(*message) << "\n";
    }
    const bool is_enough = print(*message);
    run.out << std::flush;
    if (is_enough) return ExitCode::kDone;
  }
}

ExitCode WatchHulls(const Invocation& run, const WatchOptions& options) {
  v1::WatchHullsRequest request;
  (options.exact ? request.mutable_hull_id() : request.mutable_prefix())->assign(options.prefix);
  Ending<HullWatch> ending([&] { return run.MakeClient().WatchHulls(request); });
  uint64_t events = 0;
  return PrintAll(run, ending, [&](const v1::WatchHullsResponse& message) {
    if (!run.json) Print(message, run.out);
    events += static_cast<uint64_t>(message.events_size());
    return (options.events > 0 && events >= options.events) ||
           (options.until_synced && message.synced());
  });
}

// A scene in a file: what is watched, and how its placements are called.
struct WatchedScene {
  v1::CollisionWatchOpen open;
  std::vector<std::string> names;
};

absl::StatusOr<WatchedScene> ReadJsonScene(const std::string& path, const std::string& text) {
  v1::FindCollisionsRequest request;
  const absl::Status parsed = ParseJson(text, UnknownFields::kRefuse, &request);
  if (!parsed.ok()) return absl::InvalidArgumentError(absl::StrCat(path, ": ", parsed.message()));
  WatchedScene scene;
  v1::CollisionWatchOpen& open = scene.open;
  *open.mutable_placements() = request.placements();
  *open.mutable_packed_placements() = request.packed_placements();
  *open.mutable_groups() = request.groups();
  open.set_ignore_same_group(request.ignore_same_group());
  *open.mutable_ignored_group_pairs() = request.ignored_group_pairs();
  if (request.has_movers()) open.set_movers(request.movers());
  if (request.wanted().has_clearance()) open.set_clearance(request.wanted().clearance());
  for (const v1::Placement& placement : request.placements()) {
    scene.names.push_back(absl::StrCat(scene.names.size(), ":", placement.hull_id()));
  }
  const v1::PackedPlacements& packed = request.packed_placements();
  for (const uint32_t hull : packed.hulls()) {
    const bool is_known = hull < static_cast<uint32_t>(packed.hull_ids_size());
    scene.names.push_back(absl::StrCat(scene.names.size(), ":",
                                       is_known ? packed.hull_ids(static_cast<int>(hull)) : ""));
  }
  return scene;
}

absl::StatusOr<WatchedScene> ReadTextScene(const std::string& path) {
  const auto source = ByteSource::Open(path);
  if (!source.ok()) return source.status();
  absl::StatusOr<BatchScene> batch = ReadBatchFile(source->get());
  if (!batch.ok()) return batch.status();
  if (batch->pairs.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": no pair is asked for; add `pair NAME NAME` or `all`"));
  }
  WatchedScene scene;
  for (const v1::Placement& placement : batch->placements) {
    *scene.open.add_placements() = placement;
  }
  for (const auto& [a, b] : batch->pairs) {
    scene.open.add_pairs(a);
    scene.open.add_pairs(b);
  }
  scene.names = std::move(batch->names);
  return scene;
}

// A file as `scene` reads it, or as `batch` does.
absl::StatusOr<WatchedScene> ReadScene(const std::string& path) {
  const absl::StatusOr<std::string> text = ReadText(path);
  if (!text.ok()) return text.status();
  const size_t first = text->find_first_not_of(" \t\r\n");
  const bool is_json = first != std::string::npos && (*text)[first] == '{';
  return is_json ? ReadJsonScene(path, *text) : ReadTextScene(path);
}

ExitCode WatchScene(const Invocation& run, const WatchOptions& options) {
  absl::StatusOr<WatchedScene> scene = ReadScene(options.scene);
  if (!scene.ok()) return run.FailUsage(scene.status());
  const auto name = [&](uint32_t placement) {
    return placement < scene->names.size() ? scene->names[placement] : absl::StrCat(placement);
  };
  Ending<CollisionWatch> ending([&] { return run.MakeClient().WatchCollisions(scene->open); });
  uint64_t events = 0;
  bool is_synced = false;
  return PrintAll(run, ending, [&](const v1::WatchCollisionsResponse& message) {
    for (const v1::PlacementProblem& problem : message.placement_problems()) {
      run.err << "hullctl: placement " << name(problem.placement()) << ": " << problem.message()
              << "\n";
    }
    for (const v1::CollisionEvent& event : message.events()) {
      if (run.json) break;
      run.out << KindText(event.kind()) << "\t" << name(event.placement_a()) << "\t"
              << name(event.placement_b());
      if (event.kind() != v1::COLLISION_EVENT_KIND_LOST) {
        run.out << "\t" << event.revision_a() << "\t" << event.revision_b();
      }
      run.out << "\n";
    }
    const bool is_first =
        message.synced() && !std::exchange(is_synced, is_synced || message.synced());
    if (is_first && !run.json) {
      run.out << "# synced at revision " << message.header().revision() << "\n";
    }
    events += static_cast<uint64_t>(message.events_size());
    return (options.events > 0 && events >= options.events) || (options.until_synced && is_synced);
  });
}

}  // namespace

void AddWatchCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<WatchOptions>();
  Command command = program.AddCommand("watch", "Tell of hulls, or of a scene, as they change");
  command.AddText("PREFIX", &options->prefix, "Only hulls whose names start with it");
  command.AddFlag("--exact", &options->exact, "Only the hull of this very name");
  command
      .AddText("--scene", &options->scene,
               "Tell instead when pairs of a scene begin and end to collide")
      .ValueName("FILE");
  command.AddFlag("--until-synced", &options->until_synced, "End once what is there has been told");
  command.AddNumber("--events", 1, kAnyNumber, "End after N events, or a few more at once",
                    [options](uint64_t number) { options->events = number; });
  command.SetFooter(
      "Prints a line for each event: what happened, name, revision, vertices and points, box.\n"
      "First come all hulls (PRESENT) and a line '# synced'; then what is CREATED, CHANGED,\n"
      "REPLACED and DELETED, the last state of each hull where many changes come at once. A\n"
      "watch that loses the server looks for it during --timeout and goes on where it was.\n"
      "With --scene: what happened (ENTER, TOUCH, EXIT, with a clearance NEAR and FAR, LOST\n"
      "when a hull goes), the two placements, and the revisions of their hulls. FILE is as\n"
      "'scene' or 'batch' read it. Poses stay; hulls grow.\n"
      "With --output json each message of the contract is one line. Ctrl-C ends it.");
  command.OnGiven([=] {
    invocation->action = [=] {
      const Invocation& run = *invocation;
      if (options->scene.empty()) return WatchHulls(run, *options);
      if (options->prefix.empty() && !options->exact) return WatchScene(run, *options);
      return run.FailUsage(absl::InvalidArgumentError(
          "--scene names what is watched; leave out PREFIX and --exact"));
    };
  });
}

}  // namespace hulld
