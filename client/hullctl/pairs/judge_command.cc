#include <absl/strings/str_join.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/local/file_shape.h"
#include "client/hullctl/pairs/batch_answers.h"
#include "client/hullctl/pairs/judged_table.h"
#include "client/hullctl/pairs/trade_plot.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"
#include "client/packed_placements.h"
#include "client/verify/answer_check.h"

namespace hulld {
namespace {

// Within the limits of a server with default settings.
constexpr size_t kAnswersPerCall = 65'536;

struct JudgeArguments {
  std::string file;
  Allowed allowed;
  std::string plot_file;
};

// The hulls, bodies, and files of a table, each once.
class JudgedHulls {
 public:
  // INVALID_ARGUMENT: a file cannot be read.
  absl::Status Resolve(const Invocation& run, const std::vector<JudgedAnswer>& answers) {
    for (const JudgedAnswer& answer : answers) {
      for (const std::string& name : answer.names) {
        const auto [entry, is_new] = placements_.try_emplace(name);
        if (!is_new) continue;
        entry->second.set_hull_id(name);
        if (!IsShapeFile(name)) continue;
        HULLD_RETURN_IF_ERROR(SetShape(run, name, &entry->second));
      }
    }
    Pack();
    return absl::OkStatus();
  }

  // Returns a placement without its pose.
  const v1::Placement& placement(const std::string& name) const { return placements_.at(name); }
  // The hulls and shapes, for a request without placements so far.
  const v1::PackedPlacements& packed() const { return packed_; }
  uint32_t IndexOf(const std::string& name) const { return indices_.at(name); }

 private:
  // Shapes follow the IDs.
  void Pack() {
    for (const auto& [name, placement] : placements_) {
      if (placement.has_points()) continue;
      indices_[name] = static_cast<uint32_t>(packed_.hull_ids_size());
      packed_.add_hull_ids(placement.hull_id());
    }
    for (const auto& [name, placement] : placements_) {
      if (!placement.has_points()) continue;
      indices_[name] = static_cast<uint32_t>(packed_.hull_ids_size() + packed_.shape_sizes_size());
      packed_.add_shape_sizes(static_cast<uint32_t>(placement.points().xyz_size() / 3));
      packed_.mutable_shape_points()->mutable_xyz()->MergeFrom(placement.points().xyz());
    }
  }

  std::map<std::string, v1::Placement> placements_;
  std::map<std::string, uint32_t> indices_;
  v1::PackedPlacements packed_;
};

// An answer with faults.
struct WrongAnswer {
  const JudgedAnswer* answer;
  Judgement judgement;
};

// Judges a table: queries all pairs, then proves the wrong answers, worst first.
class JudgeRun {
 public:
  JudgeRun(const Invocation& run, const std::vector<JudgedAnswer>& answers,
           const JudgedHulls& hulls, const JudgeArguments& arguments)
      : run_(run),
        answers_(answers),
        hulls_(hulls),
        arguments_(arguments),
        client_(run.MakeClient()),
        bar_(run.err, run.shows_progress, "answers", answers.size()) {}

  ExitCode Run() {
    std::vector<const JudgedAnswer*> resting;
    std::vector<const JudgedAnswer*> moving;
    for (const JudgedAnswer& answer : answers_)
      (answer.moves ? moving : resting).push_back(&answer);
    for (const auto& answers : {resting, moving}) {
      const absl::Status status = QueryAll(answers);
      if (!status.ok()) return run_.Fail(status);
    }
    bar_.Clear();
    const auto error = [](const WrongAnswer& wrong) { return wrong.judgement.error; };
    std::ranges::stable_sort(wrong_, std::greater(), error);
    for (const WrongAnswer& wrong : wrong_) {
      const absl::Status proven = Prove(wrong);
      if (!proven.ok()) return run_.Fail(proven);
    }
    PrintSummary();
    if (!arguments_.plot_file.empty()) {
      const absl::Status plotted = Plot(resting);
      if (!plotted.ok()) return run_.FailUsage(plotted);
    }
    return invalid_ > 0      ? ExitCode::kInvalidCertificate
           : !wrong_.empty() ? ExitCode::kRequestFailed
           : failed_ > 0     ? ExitCode::kSomeFailed
                             : ExitCode::kDone;
  }

 private:
  using Answers = std::span<const JudgedAnswer* const>;

  // Queries pairs that are all in motion or all at rest.
  absl::Status QueryAll(Answers answers) {
    for (size_t begin = 0; begin < answers.size(); begin += kAnswersPerCall) {
      const Answers part =
          answers.subspan(begin, std::min(kAnswersPerCall, answers.size() - begin));
      HULLD_RETURN_IF_ERROR(
          QueryBatch(client_, RequestFor(part), nullptr,
                     [&](size_t pair, const AnswerRow& row, const std::string* problem) {
                       Take(*part[pair], row, problem);
                       bar_.Update(++taken_);
                       return absl::OkStatus();
                     }));
    }
    return absl::OkStatus();
  }

  v1::BatchCheckCollisionsRequest RequestFor(Answers answers) const {
    v1::BatchCheckCollisionsRequest request;
    request.mutable_wanted()->set_separation(!answers.front()->moves);
    v1::PackedPlacements& packed = *request.mutable_packed_placements();
    packed = hulls_.packed();
    for (const JudgedAnswer* const answer : answers) {
      for (const size_t side : {size_t{0}, size_t{1}}) {
        request.add_pairs(static_cast<uint32_t>(packed.hulls_size()));
        packed.add_hulls(hulls_.IndexOf(answer->names[side]));
        const auto& pose = answer->poses[side];
        packed.mutable_poses()->Add(pose.begin(), pose.end());
        const auto& end = answer->end_poses[side];
        if (answer->moves) packed.mutable_end_poses()->Add(end.begin(), end.end());
      }
    }
    return request;
  }

  void Take(const JudgedAnswer& answer, const AnswerRow& row, const std::string* problem) {
    const bool is_open = row.relation == v1::RELATION_WITHIN_TOLERANCE;
    if (problem != nullptr || is_open) {
      ++failed_;
      bar_.Clear();
      run_.err << "hullctl: line " << answer.line << ": "
               << (is_open ? "the motion is so close to grazing that neither contact nor "
                             "separation is proven"
                           : *problem)
               << "\n";
      return;
    }
    Judgement judgement = Judge(answer, row, arguments_.allowed);
    time_error_ = std::max(time_error_, judgement.time_error);
    distance_error_ = std::max(distance_error_, judgement.distance_error);
    depth_error_ = std::max(depth_error_, judgement.depth_error);
    for (const Fault fault : judgement.faults) ++counts_[static_cast<int>(fault)];
    if (!judgement.faults.empty()) wrong_.push_back({&answer, std::move(judgement)});
  }

  // Queries again with a certificate, and with the separation as the nearest double, and prints the
  // wrong answer.
  absl::Status Prove(const WrongAnswer& wrong) {
    const bool moves = wrong.answer->moves;
    v1::CheckCollisionRequest request;
    request.mutable_wanted()->set_certificate(true);
    if (!moves) {
      request.mutable_wanted()->set_separation(true);
      request.mutable_wanted()->set_max_error(0);
    }
    for (const size_t side : {size_t{0}, size_t{1}}) {
      v1::Placement& placement = side == 0 ? *request.mutable_a() : *request.mutable_b();
      placement = hulls_.placement(wrong.answer->names[side]);
      *placement.mutable_pose() = PoseOf(wrong.answer->poses[side]);
      if (moves) *placement.mutable_end_pose() = PoseOf(wrong.answer->end_poses[side]);
    }
    HULLD_ASSIGN_OR_RETURN(const auto verified, CheckCollisionVerified(client_, request));
    if (verified.verification.verdict == Verdict::kInvalid) ++invalid_;
    AnswerRow row;
    row.relation = verified.response.relation();
    if (moves) {
      row.first_contact = verified.response.first_contact();
    } else {
      row.separation = verified.response.separation();
    }
    Print({wrong.answer, Judge(*wrong.answer, row, arguments_.allowed)}, row, request, verified);
    return absl::OkStatus();
  }

  void Print(const WrongAnswer& wrong, const AnswerRow& row,
             const v1::CheckCollisionRequest& request, const VerifiedResponse& proof) {
    const std::string faults =
        absl::StrJoin(wrong.judgement.faults, ", ",
                      [](std::string* out, Fault fault) { out->append(FaultName(fault)); });
    if (run_.names()) {
      run_.out << wrong.answer->line << "\n";
    } else if (run_.json()) {
      run_.out << JsonObject()
                      .Add("line", wrong.answer->line)
                      .Add("fault", faults)
                      .AddJson("error", JsonNumber(wrong.judgement.error))
                      .AddJson("verification", VerificationJson(proof.verification))
                      .AddJson("request", MessageJson(request))
                      .AddJson("response", MessageJson(proof.response))
                      .Close()
               << "\n";
    } else {
      run_.out << "line " << wrong.answer->line << "\t" << wrong.answer->names[0] << "\t"
               << wrong.answer->names[1] << "\t" << run_.paint(Hue::kBad, faults) << "\toff by "
               << ShortestText(wrong.judgement.error) << "\t" << RowText(row, run_.paint) << "\t"
               << VerificationText(proof.verification, run_.paint) << "\n";
    }
    run_.out << std::flush;
  }

  // Infinity is a string, as in the JSON mapping of proto3.
  static std::string JsonNumber(double number) {
    return std::isinf(number) ? QuoteJson("Infinity") : ShortestText(number);
  }

  void PrintSummary() {
    constexpr const char* kMembers[kFaults] = {"falseContacts",  "misses",      "touchingMistaken",
                                               "wrongDistances", "wrongDepths", "wrongTimes"};
    if (run_.names()) return;
    if (run_.json()) {
      JsonObject object;
      object.Add("answers", uint64_t{answers_.size()}).Add("wrong", uint64_t{wrong_.size()});
      for (int i = 0; i < kFaults; ++i) object.Add(kMembers[i], counts_[i]);
      object.Add("failed", failed_)
          .AddJson("largestDistanceError", JsonNumber(distance_error_))
          .AddJson("largestDepthError", JsonNumber(depth_error_))
          .AddJson("largestTimeError", JsonNumber(time_error_));
      run_.out << object.Close() << "\n";
      return;
    }
    run_.out << "# " << Counted(answers_.size(), "answer") << ", " << wrong_.size() << " wrong, "
             << failed_ << " failed\n#";
    for (int i = 0; i < kFaults; ++i) {
      run_.out << (i > 0 ? ", " : " ") << FaultName(static_cast<Fault>(i)) << " " << counts_[i];
    }
    run_.out << "\n# largest error of a distance " << ShortestText(distance_error_)
             << ", of a depth " << ShortestText(depth_error_) << ", of a time "
             << ShortestText(time_error_) << "\n";
  }

  // Plots time against error: the program's as a point, this server's as a curve over the requested
  // accuracy.
  absl::Status Plot(Answers resting) {
    TradePlot plot;
    for (const JudgedAnswer& answer : answers_) {
      if (answer.microseconds) plot.times.push_back(*answer.microseconds);
    }
    plot.error = std::max(distance_error_, depth_error_);
    plot.wrong = static_cast<double>(wrong_.size()) / static_cast<double>(answers_.size());
    if (resting.empty() || plot.times.empty()) {
      return absl::InvalidArgumentError(
          "--plot needs pairs at rest and a column us, the microseconds of each answer");
    }
    const Answers part = resting.subspan(0, std::min(kAnswersPerCall, resting.size()));
    for (const double exponent : {-15.0, -12.0, -9.0, -6.0, -3.0}) {
      HULLD_ASSIGN_OR_RETURN(const auto point, Measure(part, std::pow(10, exponent)));
      plot.server.push_back(point);
    }
    return WriteTradePlot(plot, arguments_.plot_file);
  }

  // Returns the time of a pair, and the largest proven bound.
  absl::StatusOr<TradePoint> Measure(Answers answers, double max_error) {
    v1::BatchCheckCollisionsRequest request = RequestFor(answers);
    request.mutable_wanted()->set_max_error(max_error);
    TradePoint point;
    const auto start = std::chrono::steady_clock::now();
    const absl::Status status =
        QueryBatch(client_, request, nullptr,
                   [&](size_t /*pair*/, const AnswerRow& row, const std::string* problem) {
                     if (problem == nullptr) {
                       point.error = std::max(point.error, row.separation->bound());
                     }
                     return absl::OkStatus();
                   });
    const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
    point.microseconds = time.count() / static_cast<double>(answers.size());
    if (!status.ok()) return status;
    return point;
  }

  const Invocation& run_;
  const std::vector<JudgedAnswer>& answers_;
  const JudgedHulls& hulls_;
  const JudgeArguments& arguments_;
  const Client client_;
  ProgressBar bar_;
  std::vector<WrongAnswer> wrong_;
  uint64_t counts_[kFaults] = {};
  uint64_t failed_ = 0;
  uint64_t invalid_ = 0;
  double distance_error_ = 0;
  double depth_error_ = 0;
  double time_error_ = 0;
  uint64_t taken_ = 0;
};

ExitCode JudgeTable(const Invocation& run, const JudgeArguments& arguments) {
  std::vector<std::string> ignored;
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto answers,
                       ReadJudgedTable(arguments.file, &ignored));
  if (!ignored.empty()) {
    run.err << "hullctl: " << arguments.file
            << ": ignored columns: " << absl::StrJoin(ignored, ", ") << "\n";
  }
  JudgedHulls hulls;
  if (absl::Status resolved = hulls.Resolve(run, answers); !resolved.ok()) {
    return run.FailUsage(resolved);
  }
  return JudgeRun(run, answers, hulls, arguments).Run();
}

}  // namespace

void AddJudgeCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<JudgeArguments>();
  Command command = program.AddCommand("judge", "Find the wrong answers of another program");
  command.AddText("FILE", &arguments->file, "A table of answers, CSV; - is standard input")
      .Required();
  command.AddLength("--max-error",
                    "Largest error that a distance or depth may have (default 0: as exact as the "
                    "proven bound)",
                    &arguments->allowed.error);
  command.AddLength("--max-time-error",
                    "How far a time of contact may be outside of the proven bracket (default 0)",
                    &arguments->allowed.time_error);
  command
      .AddText("--plot", &arguments->plot_file,
               "Plot time and error of the program next to those of hulld, as SVG, with gnuplot")
      .ValueName("FILE");
  AddFreshnessOptions(command, invocation);
  command.SetDetails(
      "The table has a header of column names, in any order, then a row for each answer:\n"
      "  a, b                    IDs of hulls or bodies, or files with points\n"
      "  a_x, a_y, a_z           translation of a (default 0), likewise b_x and so on\n"
      "  a_qw, a_qx, a_qy, a_qz  quaternion of a (default identity), likewise b_qw and so on\n"
      "  a_to_x, ..., a_to_qz    pose of a at the end of a motion (default: that of the start)\n"
      "  relation                SEPARATED, TOUCHING, or OVERLAPPING\n"
      "  colliding               0 or 1, of a program that does not distinguish touching from "
      "overlapping\n"
      "  distance                0 or more; a negative value is minus a depth\n"
      "  depth                   0 or more\n"
      "  contact_time            time of the first contact of a motion, 0 to 1\n"
      "  us                      microseconds of the answer, for --plot\n"
      "An empty cell means no answer. Other columns are ignored, with a note. Wrong answers are\n"
      "printed worst first, each with the exact relation, the separation, and the check of its\n"
      "certificate by hullctl's own exact arithmetic; with --output json, each line is a record\n"
      "for 'hullctl verify'. Exits with 1 if an answer is wrong.");
  command.SetExamples(
      {{"", "hullctl judge answers.csv"},
       {"Files, without a server; distances to a micrometer",
        "hullctl judge answers.csv --local --max-error 1e-6"},
       {"A chart of time and error", "hullctl judge answers.csv --plot trade.svg"}});
  OnGiven(command, invocation, arguments, JudgeTable);
}

}  // namespace hulld
