// watch: hulls as they come, change and go.
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <memory>
#include <mutex>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

struct WatchOptions {
  std::string prefix;
  bool exact = false;
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

void Print(const v1::WatchHullsResponse& message, const Invocation& run) {
  if (run.json()) {
    run.out << MessageJson(message) << "\n" << std::flush;
    return;
  }
  if (message.anew()) run.out << "# anew: forget what is above\n";
  for (const v1::HullEvent& event : message.events()) {
    run.out << (run.names() ? event.hull().hull_id() : EventText(event)) << "\n";
  }
  if (message.synced()) run.out << "# synced at revision " << message.header().revision() << "\n";
  run.out << std::flush;
}

ExitCode Watch(const Invocation& run, const WatchOptions& options) {
  v1::WatchHullsRequest request;
  (options.exact ? request.mutable_hull_id() : request.mutable_prefix())->assign(options.prefix);
  HullWatch* ended = nullptr;
  std::mutex mutex;
  bool interrupted = false;
  const Interrupt interrupt([&] {
    const std::lock_guard lock(mutex);
    interrupted = true;
    if (ended != nullptr) ended->Cancel();
  });
  const std::unique_ptr<HullWatch> watch = run.MakeClient().WatchHulls(request);
  {
    const std::lock_guard lock(mutex);
    ended = watch.get();
    if (interrupted) watch->Cancel();
  }
  for (uint64_t events = 0; options.events == 0 || events < options.events;) {
    const absl::StatusOr<v1::WatchHullsResponse> message = watch->Next();
    if (!message.ok()) {
      const std::lock_guard lock(mutex);
      return interrupted ? ExitCode::kDone : run.Fail(message.status());
    }
    Print(*message, run);
    if (options.until_synced && message->synced()) break;
    events += static_cast<uint64_t>(message->events_size());
  }
  return ExitCode::kDone;
}

}  // namespace

void AddWatchCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<WatchOptions>();
  Command command = program.AddCommand("watch", "Tell of hulls as they come, change and go");
  command.AddText("PREFIX", &options->prefix, "Only names that start with it")
      .Completes(ValueKind::kHull);
  command.AddFlag("--exact", &options->exact, "Only the hull of this very name");
  command.AddFlag("--until-synced", &options->until_synced, "End once what is there has been told");
  command.AddNumber("--events", 1, kAnyNumber, "End after N events, or a few more at once",
                    [options](uint64_t number) { options->events = number; });
  command.SetDetails(
      "Prints a line for each event: what happened, name, revision, vertices and points, box.\n"
      "First come all hulls (PRESENT) and a line '# synced'; then what is CREATED, CHANGED,\n"
      "REPLACED and DELETED, the last state of each hull where many changes come at once.\n"
      "With --output json each message of the contract is one line. Ctrl-C ends it. A watch\n"
      "that loses the server looks for it during --timeout and goes on where it was.");
  command.SetExamples(
      {{"Those of one cell", "hullctl watch cell-3/"},
       {"What is there, for a script", "hullctl watch --until-synced --output json"}});
  command.OnGiven([=] { invocation->action = [=] { return Watch(*invocation, *options); }; });
}

}  // namespace hulld
