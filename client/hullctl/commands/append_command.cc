#include <unistd.h>

#include <memory>
#include <optional>

#include "client/hullctl/command_line/point_input.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

struct AppendArguments {
  std::string hull_id;
  PointInput input;
  bool create = false;
  bool resume = false;
  std::string writer;
};

// Reads files into one stream.
class FileAppender {
 public:
  FileAppender(const Invocation& run, Appender* appender, uint64_t resume_after,
               uint64_t total_bytes)
      : appender_(appender),
        to_skip_(resume_after),
        bar_(run.err, isatty(STDERR_FILENO) != 0, total_bytes) {}

  // Either the file or the stream fails; the other status is OK then.
  struct Outcome {
    absl::Status file;
    absl::Status stream;
    bool ok() const { return file.ok() && stream.ok(); }
  };

  Outcome Read(ReadRequest request) {
    Outcome outcome;
    uint64_t file_bytes = 0;
    request.progress = [&](uint64_t bytes) {
      file_bytes = bytes;
      bar_.Update(bytes_before_ + bytes, appender_->totals().points_sent);
    };
    const auto counts = ReadPoints(request, [&](const PointBlock& block) {
      if (to_skip_ > 0) {
        --to_skip_;
        resumed_points_ += block.size();
        return absl::OkStatus();
      }
      outcome.stream = appender_->Append(ToProto(block));
      return outcome.stream;
    });
    bytes_before_ += file_bytes;
    if (counts.ok()) {
      skipped_ += counts->skipped;
    } else if (outcome.stream.ok()) {
      outcome.file = counts.status();
    }
    return outcome;
  }

  absl::Status Finish() {
    absl::Status status = appender_->Finish();
    bar_.Clear();
    return status;
  }

  void Clear() { bar_.Clear(); }
  uint64_t skipped() const { return skipped_; }
  uint64_t resumed_points() const { return resumed_points_; }

 private:
  Appender* appender_;
  uint64_t to_skip_;
  ProgressBar bar_;
  uint64_t bytes_before_ = 0;
  uint64_t skipped_ = 0;
  uint64_t resumed_points_ = 0;
};

void Print(const Invocation& run, const std::string& hull_id, const Appender& appender,
           const FileAppender& files) {
  const AppendTotals& totals = appender.totals();
  const v1::PointCounts& counts = totals.counts;
  if (run.json) {
    run.out << JsonObject()
                   .Add("hullId", hull_id)
                   .Add("writerId", appender.writer_id())
                   .Add("pointsSent", totals.points_sent)
                   .Add("pointsAcknowledged", totals.points_acknowledged)
                   .Add("pointsSkippedNonfinite", files.skipped())
                   .Add("pointsCommittedBefore", files.resumed_points())
                   .Add("chunks", totals.chunks_sent)
                   .Add("reconnects", totals.reconnects)
                   .AddJson("counts", MessageJson(counts))
                   .Add("vertexCount", totals.vertex_count)
                   .Add("hullRevision", totals.hull_revision)
                   .Close()
            << "\n";
    return;
  }
  Table table;
  table.Row({"hull", hull_id})
      .Row({"points", std::to_string(totals.points_acknowledged) + " appended in " +
                          std::to_string(totals.chunks_sent) + " chunks"})
      .Row({"outside", std::to_string(counts.outside())})
      .Row({"duplicate", std::to_string(counts.duplicate())})
      .Row({"inside", std::to_string(counts.inside())});
  if (files.skipped() > 0) {
    table.Row({"skipped", std::to_string(files.skipped()) + " points that are not finite"});
  }
  if (files.resumed_points() > 0) {
    table.Row(
        {"resumed", std::to_string(files.resumed_points()) + " points were committed before"});
  }
  if (totals.chunks_recovered > 0) {
    table.Row({"reconnected", std::to_string(totals.reconnects) + " times; the counts lack " +
                                  std::to_string(totals.chunks_recovered) + " chunks"});
  }
  table.Row({"vertices", std::to_string(totals.vertex_count)})
      .Row({"revision", std::to_string(totals.hull_revision)});
  table.Print(run.out);
}

// Says, before an error is reported, which points stand in spite of it.
void PrintAppendedBefore(const Invocation& run, const Appender& appender) {
  const uint64_t points = appender.totals().points_acknowledged;
  if (points == 0) return;
  run.err << "hullctl: " << points << " points were appended before this error\n";
}

ExitCode Append(const Invocation& run, const AppendArguments& arguments) {
  uint64_t total_bytes = 0;
  auto plan = PlanReads(arguments.input, &total_bytes);
  if (!plan.ok()) return run.FailUsage(plan.status());
  AppendOptions options;
  options.writer_id = arguments.writer;
  options.create_if_absent = arguments.create;
  auto opened = run.MakeClient().OpenAppend(arguments.hull_id, options);
  if (absl::IsNotFound(opened.status()) && !arguments.create) {
    const std::string message(opened.status().message().data(), opened.status().message().size());
    run.err << "hullctl: " << message << " (create it with --create, or see 'hullctl list')\n";
    return ExitCode::kRequestFailed;
  }
  if (!opened.ok()) return run.Fail(opened.status());
  Appender& appender = **opened;
  const uint64_t resume_after = arguments.resume ? appender.opened().last_sequence() : 0;
  FileAppender files(run, &appender, resume_after, total_bytes);
  FileAppender::Outcome outcome;
  for (auto request = plan->begin(); request != plan->end() && outcome.ok(); ++request) {
    outcome = files.Read(std::move(*request));
  }
  // Points read before a file's error are sent already: wait for them, so that the summary is true.
  if (outcome.stream.ok()) outcome.stream = files.Finish();
  files.Clear();
  if (!outcome.stream.ok()) {
    PrintAppendedBefore(run, appender);
    return run.Fail(outcome.stream);
  }
  if (outcome.file.ok() || appender.totals().points_acknowledged > 0) {
    Print(run, arguments.hull_id, appender, files);
  }
  if (outcome.file.ok()) return ExitCode::kDone;
  PrintAppendedBefore(run, appender);
  return run.FailUsage(outcome.file);
}

}  // namespace

void AddAppendCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<AppendArguments>();
  Command command = program.AddCommand("append", "Add the points of files to a hull");
  command.AddText("ID", &arguments->hull_id, "Name of the hull").Required();
  AddPointInput(command, &arguments->input);
  command.AddFlag("--create", &arguments->create, "Create the hull when it does not exist");
  const Option writer =
      command.AddText("--writer", &arguments->writer, "Name to write under (default: random)")
          .ValueName("NAME");
  command
      .AddFlag("--resume", &arguments->resume,
               "The same command was interrupted: leave out the chunks that this writer has "
               "committed")
      .Needs(writer);
  command.SetFooter(
      "Formats: obj, off, ply, xyz, csv, pcd (text becomes the nearest double), stl, gltf.\n"
      "--resume needs the same files, options and writer as before.");
  command.OnGiven([=] { invocation->action = [=] { return Append(*invocation, *arguments); }; });
}

}  // namespace hulld
