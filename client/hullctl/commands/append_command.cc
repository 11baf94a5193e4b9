#include <memory>
#include <optional>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/command_line/point_input.h"
#include "client/hullctl/parts/split_append.h"
#include "client/hullctl/parts/volume_comparison.h"
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
  std::optional<SplitBy> split;
};

// Appends files to one hull. The stream opens, and --create creates the hull, when the first points
// are read: unreadable files have no effect.
class FileAppender {
 public:
  FileAppender(const Invocation& run, const AppendArguments& arguments, uint64_t total_bytes)
      : arguments_(arguments),
        client_(run.MakeClient()),
        bar_(run.err, run.shows_progress, "points", total_bytes) {}

  // Either the file or the stream fails; the other status is then OK.
  struct Outcome {
    absl::Status file;
    absl::Status stream;
    bool ok() const { return file.ok() && stream.ok(); }
  };

  // An interrupt ends the read with CANCELLED.
  Outcome Read(ReadRequest request, const Interrupt& interrupt) {
    Outcome outcome;
    uint64_t file_bytes = 0;
    request.progress = [&](uint64_t bytes) {
      file_bytes = bytes;
      bar_.Update(bytes_before_ + bytes, appender_ ? appender_->totals().points_sent : 0);
    };
    const auto counts = ReadPoints(request, [&](const PointChunk& block) {
      if (interrupt.has_arrived()) return absl::CancelledError("interrupted");
      outcome.stream = Take(block);
      return outcome.stream;
    });
    bytes_before_ += file_bytes;
    if (counts.ok()) {
      skipped_.skipped += counts->skipped;
      skipped_.zeros += counts->zeros;
    } else if (outcome.stream.ok()) {
      outcome.file = counts.status();
    }
    return outcome;
  }

  // Waits for the last acknowledgement. Without points, still checks that the hull exists.
  absl::Status Finish() {
    absl::Status status;
    if (appender_ == nullptr) status = Open();
    if (status.ok()) status = appender_->Finish();
    bar_.Clear();
    return status;
  }

  void Clear() { bar_.Clear(); }

  // Removes the hull if this command created it and nothing has been committed to it since.
  absl::Status RemoveIfEmpty() const {
    if (!created_.has_value()) return absl::OkStatus();
    const absl::Status status =
        client_.DeleteHull(arguments_.hull_id, created_->create_revision()).status();
    // The hull is kept if points were committed without an acknowledgement.
    return absl::IsAborted(status) || absl::IsNotFound(status) ? absl::OkStatus() : status;
  }

  // Null before the first points.
  const Appender* appender() const { return appender_.get(); }
  // Counts of the skipped points only.
  const ReadCounts& skipped() const { return skipped_; }
  uint64_t resumed_points() const { return resumed_points_; }

 private:
  absl::Status Take(const PointChunk& block) {
    if (appender_ == nullptr) {
      HULLD_RETURN_IF_ERROR(Create());
      HULLD_RETURN_IF_ERROR(Open());
      to_skip_ = arguments_.resume ? appender_->opened().last_sequence() : 0;
    }
    if (to_skip_ == 0) return appender_->Append(ToProto(block));
    --to_skip_;
    resumed_points_ += block.size();
    return absl::OkStatus();
  }

  absl::Status Create() {
    if (!arguments_.create) return absl::OkStatus();
    const auto response = client_.CreateHull(arguments_.hull_id, /*if_absent=*/true);
    if (response.ok() && response->created()) created_ = response->hull();
    return response.status();
  }

  absl::Status Open() {
    AppendOptions options;
    options.writer_id = arguments_.writer;
    HULLD_ASSIGN_OR_RETURN(appender_, client_.OpenAppend(arguments_.hull_id, options));
    return absl::OkStatus();
  }

  const AppendArguments& arguments_;
  const Client client_;
  std::unique_ptr<Appender> appender_;
  // The hull, if this command created it.
  std::optional<v1::HullInfo> created_;
  uint64_t to_skip_ = 0;
  ProgressBar bar_;
  uint64_t bytes_before_ = 0;
  ReadCounts skipped_;
  uint64_t resumed_points_ = 0;
};

// Prints `opened`, then the sum of all acknowledgements, as messages of the contract.
void PrintAppendedJson(const Appender& appender, std::ostream& out) {
  v1::AppendPointsResponse opened;
  *opened.mutable_opened() = appender.opened();
  out << MessageJson(opened) << "\n";
  const AppendTotals& totals = appender.totals();
  if (totals.last_ack.sequence() == 0) return;
  v1::AppendPointsResponse acknowledged;
  *acknowledged.mutable_ack() = totals.last_ack;
  *acknowledged.mutable_ack()->mutable_counts() = totals.counts;
  out << MessageJson(acknowledged) << "\n";
}

// volumes: see CompareVolumes; empty if unknown.
void PrintAppended(const Invocation& run, const std::string& hull_id, const FileAppender& files,
                   const VolumeComparison& volumes) {
  const Appender& appender = *files.appender();
  const AppendTotals& totals = appender.totals();
  const v1::PointCounts& counts = totals.counts;
  const std::vector<std::string> skipped = SkippedTexts(files.skipped());
  if (run.form != OutputForm::kTable && !run.wide()) {
    for (const std::string& text : skipped) run.err << "hullctl: " << text << " were skipped\n";
  }
  if (run.json()) return PrintAppendedJson(appender, run.out);
  if (run.names()) {
    run.out << hull_id << "\n";
    return;
  }
  Table table;
  table.Row({"hull", hull_id})
      .Row({"points", std::to_string(totals.points_acknowledged) + " appended in " +
                          Counted(totals.chunks_sent, "chunk")})
      .Row({"outside", std::to_string(counts.outside())})
      .Row({"duplicate", std::to_string(counts.duplicate())})
      .Row({"inside", std::to_string(counts.inside())});
  for (const std::string& text : skipped) table.Row({"skipped", text});
  if (files.resumed_points() > 0) {
    table.Row({"resumed", Counted(files.resumed_points(), "point") + " already committed"});
  }
  if (totals.chunks_recovered > 0) {
    table.Row({"reconnected", Counted(totals.reconnects, "time") + "; the counts exclude " +
                                  Counted(totals.chunks_recovered, "chunk")});
  }
  table.Row({"vertices", std::to_string(totals.vertex_count)})
      .Row({"revision", std::to_string(totals.hull_revision)});
  if (!volumes.text.empty()) table.Row({"volume", volumes.text});
  table.Print(run.out);
}

// Reports the committed points after Ctrl-C, and how to add the rest.
ExitCode ReportInterrupt(const Invocation& run, const AppendArguments& arguments,
                         const FileAppender& files) {
  const Appender* const appender = files.appender();
  const uint64_t points = appender == nullptr ? 0 : appender->totals().points_acknowledged;
  run.err << "hullctl: interrupted; " << Counted(points, "point") << " committed to "
          << arguments.hull_id << "; "
          << (arguments.writer.empty()
                  ? "run the command again to append the rest; committed points are counted again"
                  : "add --resume to the command to append the rest")
          << "\n";
  if (points == 0) static_cast<void>(files.RemoveIfEmpty());
  return ExitCode::kRequestFailed;
}

ExitCode FailAppend(const Invocation& run, const AppendArguments& arguments,
                    const FileAppender& files, const FileAppender::Outcome& outcome) {
  const Appender* const appender = files.appender();
  const uint64_t points = appender == nullptr ? 0 : appender->totals().points_acknowledged;
  if (points > 0) {
    run.err << "hullctl: appended " << Counted(points, "point") << " before this error\n";
  } else if (const absl::Status removed = files.RemoveIfEmpty(); !removed.ok()) {
    run.err << "hullctl: the hull " << arguments.hull_id
            << ", created by this command, may be left empty\n";
  }
  if (outcome.stream.ok()) return run.FailUsage(outcome.file);
  if (!absl::IsNotFound(outcome.stream)) return run.Fail(outcome.stream);
  const char* const advice =
      arguments.create
          ? "the files contain no points to create it from; 'hullctl create' creates an empty hull"
          : "create it with --create, or see 'hullctl list'";
  run.err << "hullctl: " << outcome.stream.message() << " (" << advice << ")\n";
  return arguments.create ? ExitCode::kUsage : ExitCode::kRequestFailed;
}

// Returns the volume of the hull relative to the mesh of the files, if known.
VolumeComparison CompareVolumesOfFiles(const Invocation& run, const AppendArguments& arguments,
                                       const std::vector<ReadRequest>& plan, uint64_t points) {
  const auto mesh = MeshOf(plan);
  if (!mesh.has_value()) return {};
  const auto volumes = CompareVolumes(run.MakeClient(), arguments.hull_id, points, *mesh);
  // The points are appended; failing to read the hull afterwards does not fail the append.
  return volumes.ok() ? *volumes : VolumeComparison{};
}

ExitCode SplitAppend(const Invocation& run, const AppendArguments& arguments) {
  const PointInput& input = arguments.input;
  if (arguments.resume || !arguments.writer.empty() || input.skip_nonfinite || input.skip_zero ||
      !input.format.empty() || input.chunk_points != 0) {
    return run.FailUsage(
        "--split can be combined only with --create; the format follows from the file name");
  }
  return AppendParts(run, arguments.hull_id, input.files, *arguments.split, arguments.create);
}

ExitCode AppendFiles(const Invocation& run, const AppendArguments& arguments) {
  if (arguments.split.has_value()) return SplitAppend(run, arguments);
  uint64_t total_bytes = 0;
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto plan, PlanReads(arguments.input, &total_bytes));
  const Interrupt interrupt;
  FileAppender files(run, arguments, total_bytes);
  FileAppender::Outcome outcome;
  for (auto request = plan.begin(); request != plan.end() && outcome.ok(); ++request) {
    outcome = files.Read(*request, interrupt);
  }
  // Points before a file's error were already sent: waits for them, so that the summary is correct.
  const bool sent = files.appender() != nullptr;
  if (outcome.ok() || (sent && outcome.stream.ok())) outcome.stream = files.Finish();
  files.Clear();
  if (interrupt.has_arrived() && outcome.stream.ok()) return ReportInterrupt(run, arguments, files);
  if (!outcome.stream.ok()) return FailAppend(run, arguments, files, outcome);
  if (outcome.file.ok() || (sent && files.appender()->totals().points_acknowledged > 0)) {
    const bool whole = outcome.file.ok() && files.appender() != nullptr;
    const VolumeComparison volumes =
        whole ? CompareVolumesOfFiles(run, arguments, plan,
                                      files.appender()->totals().points_acknowledged)
              : VolumeComparison{};
    PrintAppended(run, arguments.hull_id, files, volumes);
    WarnOfVolumeRatio(run, arguments.hull_id, volumes.ratio);
  }
  return outcome.file.ok() ? ExitCode::kDone : FailAppend(run, arguments, files, outcome);
}

}  // namespace

void AddAppendCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<AppendArguments>();
  Command command = program.AddCommand("append", "Add the points of files to a hull");
  command.AddText("ID", &arguments->hull_id, "ID of the hull")
      .Required()
      .Completes(ValueKind::kHull);
  AddPointInput(command, &arguments->input);
  command.AddFlag("--create", &arguments->create, "Create the hull if it does not exist");
  const Option writer = command
                            .AddText("--writer", &arguments->writer,
                                     "Name of the writer, for --resume (default: random)")
                            .ValueName("NAME");
  command
      .AddFlag("--resume", &arguments->resume,
               "Resume an interrupted command: skip the chunks that this writer has committed")
      .Needs(writer);
  command
      .AddChoice<std::optional<SplitBy>>(
          "--split", {{"names", SplitBy::kName}, {"components", SplitBy::kComponent}},
          &arguments->split,
          "Append each part to a hull of its own, ID/PART, and combine them as the body ID. Parts "
          "are named in the file (objects and groups of obj, solids of stl, nodes of gltf and "
          "dae), or are connected components")
      .ValueName("HOW");
  command.SetDetails(
      "Formats: obj, off, ply, xyz, csv, pcd, pts (text becomes the nearest double), las, stl,\n"
      "gltf, dae.\n"
      "--create creates the hull with its first points. Points are sent in chunks: if an error\n"
      "occurs later in a file, the chunks before it remain in the hull; 'hullctl replace' takes\n"
      "all points or none.\n"
      "--resume needs the same files, options, and writer as before.\n"
      "--split can be repeated: a body that has all parts is not changed.\n"
      "For a closed mesh, the ratio of the volumes of hull and mesh is printed, both summed\n"
      "exactly; a ratio of 1.5 or more causes a warning.");
  command.SetExamples({{"A new hull from a file", "hullctl append spider spider.obj --create"},
                       {"Points from another program", "scanner | hullctl append room - --create"},
                       {"An append that can be resumed after an interruption",
                        "hullctl append ball ball.xyz --create --writer lab"},
                       {"", "hullctl append ball ball.xyz --writer lab --resume"},
                       {"Each object of a file as chair/OBJECT, and all as the body chair",
                        "hullctl append chair chair.obj --split names --create"}});
  OnGiven(command, invocation, arguments, AppendFiles);
}

}  // namespace hulld
