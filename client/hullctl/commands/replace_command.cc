#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <memory>
#include <optional>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/point_input.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

struct ReplaceArguments {
  std::string hull_id;
  PointInput input;
  bool create = false;
  bool allow_empty = false;
  std::optional<uint64_t> if_revision;
};

void PrintReplaced(const Invocation& run, const v1::ReplaceHullResponse& response,
                   const ReadCounts& counts) {
  const std::vector<std::string> skipped = SkippedTexts(counts);
  if (run.form != OutputForm::kTable && !run.wide()) {
    for (const std::string& text : skipped) run.err << "hullctl: " << text << " were skipped\n";
  }
  const v1::HullInfo& hull = response.hull();
  if (run.PrintForPrograms(response, hull.hull_id())) return;
  Table table;
  table.Row({"hull", hull.hull_id() + (response.created() ? " created" : " replaced")})
      .Row({"points", std::to_string(hull.counts().received())});
  for (const std::string& text : skipped) table.Row({"skipped", text});
  table.Row({"vertices", std::to_string(hull.vertex_count())})
      .Row({"revision", std::to_string(hull.revision())});
  table.Print(run.out);
}

absl::Status NoPoints(const std::string& files) {
  return absl::InvalidArgumentError(absl::StrCat(
      "no points in ", files, "; nothing was changed; pass --allow-empty to accept this"));
}

ExitCode Replace(const Invocation& run, const ReplaceArguments& arguments) {
  uint64_t total_bytes = 0;
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto plan, PlanReads(arguments.input, &total_bytes));
  v1::ReplaceOpen open;
  open.set_hull_id(arguments.hull_id);
  open.set_create_if_absent(arguments.create);
  if (arguments.if_revision.has_value()) open.set_if_revision(*arguments.if_revision);
  ProgressBar bar(run.err, run.shows_progress, "points", total_bytes);
  // An unreadable file ends the call and leaves the hull unchanged.
  absl::Status file_error;
  ReadCounts skipped;
  const auto feed = [&](const Client::PointSink& sink) -> absl::Status {
    uint64_t bytes_before = 0;
    uint64_t points = 0;
    for (ReadRequest& request : plan) {
      request.options.allow_empty = true;
      uint64_t file_bytes = 0;
      absl::Status stream;
      request.progress = [&](uint64_t bytes) {
        file_bytes = bytes;
        bar.Update(bytes_before + bytes, points);
      };
      const auto counts = ReadPoints(request, [&](const PointChunk& block) {
        points += block.size();
        stream = sink(ToProto(block));
        return stream;
      });
      bytes_before += file_bytes;
      if (!stream.ok()) return stream;
      if (!counts.ok()) return file_error = counts.status();
      if (counts->is_empty() && !arguments.allow_empty) {
        return file_error = NoPoints(request.path);
      }
      skipped.skipped += counts->skipped;
      skipped.zeros += counts->zeros;
    }
    // The writer of a pipe may have failed: replacing a hull with an empty one needs --allow-empty.
    if (points == 0 && !arguments.allow_empty) {
      file_error = NoPoints(absl::StrJoin(arguments.input.files, ", "));
    }
    return file_error;
  };
  const auto response = run.MakeClient().ReplaceHull(open, feed, run.given_timeout);
  bar.Clear();
  if (!file_error.ok()) return run.FailUsage(file_error);
  if (!response.ok()) return run.Fail(response.status());
  PrintReplaced(run, *response, skipped);
  return ExitCode::kDone;
}

}  // namespace

void AddReplaceCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<ReplaceArguments>();
  Command command = program.AddCommand(
      "replace", "Atomically replace a hull with the hull of the points in files");
  command.AddText("ID", &arguments->hull_id, "ID of the hull")
      .Required()
      .Completes(ValueKind::kHull);
  AddPointInput(command, &arguments->input);
  command.AddFlag("--create", &arguments->create, "Create the hull if it does not exist");
  command.AddFlag("--allow-empty", &arguments->allow_empty,
                  "Accept files without points: the hull becomes empty");
  command.AddNumber("--if-revision", 0, std::numeric_limits<uint64_t>::max(),
                    "Only if the hull is at this revision; 0: only if it does not exist",
                    &arguments->if_revision);
  command.SetDetails(
      "Runs without a time limit unless --timeout is given. A failed call leaves the hull\n"
      "unchanged, except that it may have been replaced if all points had been sent.");
  command.SetExamples({{"", "hullctl replace arm arm-v2.stl"},
                       {"Only if it is unchanged since revision 7",
                        "hullctl replace arm arm-v2.stl --if-revision 7"}});
  OnGiven(command, invocation, arguments, Replace);
}

}  // namespace hulld
