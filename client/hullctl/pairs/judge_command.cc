#include "client/hullctl/pairs/judge_command.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/freshness_options.h"
#include "client/hullctl/local/file_shape.h"
#include "client/hullctl/pairs/batch_answers.h"
#include "client/hullctl/pairs/judged_table.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"
#include "client/verify/answer_check.h"

namespace hulld {
namespace {

// Within the limits of a server with default settings.
constexpr size_t kAnswersPerCall = 65'536;

struct JudgeArguments {
  std::string file;
  double max_error = 0;
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
        const absl::Status set = SetShape(run, name, &entry->second);
        if (!set.ok()) return set;
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

// Judges a table: asks about all pairs, then proves the wrong answers, worst first.
class JudgeRun {
 public:
  JudgeRun(const Invocation& run, const std::vector<JudgedAnswer>& answers,
           const JudgedHulls& hulls, double max_error)
      : run_(run),
        answers_(answers),
        hulls_(hulls),
        max_error_(max_error),
        client_(run.MakeClient()),
        bar_(run.err, run.shows_progress, "answers", answers.size()) {}

  ExitCode Run() {
    for (size_t begin = 0; begin < answers_.size(); begin += kAnswersPerCall) {
      const absl::Status asked = Ask(begin, std::min(begin + kAnswersPerCall, answers_.size()));
      if (!asked.ok()) return run_.Fail(asked);
    }
    bar_.Clear();
    std::stable_sort(wrong_.begin(), wrong_.end(), [](const WrongAnswer& a, const WrongAnswer& b) {
      return a.judgement.error > b.judgement.error;
    });
    for (const WrongAnswer& wrong : wrong_) {
      const absl::Status proven = Prove(wrong);
      if (!proven.ok()) return run_.Fail(proven);
    }
    PrintSummary();
    return invalid_ > 0      ? ExitCode::kInvalidCertificate
           : !wrong_.empty() ? ExitCode::kRequestFailed
           : failed_ > 0     ? ExitCode::kSomeFailed
                             : ExitCode::kDone;
  }

 private:
  absl::Status Ask(size_t begin, size_t end) {
    v1::BatchCheckCollisionsRequest request;
    request.mutable_wanted()->set_separation(true);
    v1::PackedPlacements& packed = *request.mutable_packed_placements();
    packed = hulls_.packed();
    for (size_t i = begin; i < end; ++i) {
      for (const size_t side : {size_t{0}, size_t{1}}) {
        request.add_pairs(static_cast<uint32_t>(packed.hulls_size()));
        packed.add_hulls(hulls_.IndexOf(answers_[i].names[side]));
        const auto& pose = answers_[i].poses[side];
        packed.mutable_poses()->Add(pose.begin(), pose.end());
      }
    }
    return AskBatch(client_, request, nullptr,
                    [&](size_t pair, const AnswerRow& row, const std::string* problem) {
                      Take(answers_[begin + pair], row, problem);
                      bar_.Update(begin + pair + 1);
                      return absl::OkStatus();
                    });
  }

  void Take(const JudgedAnswer& answer, const AnswerRow& row, const std::string* problem) {
    if (problem != nullptr) {
      ++failed_;
      bar_.Clear();
      run_.err << "hullctl: line " << answer.line << ": " << *problem << "\n";
      return;
    }
    Judgement judgement = Judge(answer, row, max_error_);
    distance_error_ = std::max(distance_error_, judgement.distance_error);
    depth_error_ = std::max(depth_error_, judgement.depth_error);
    for (const Fault fault : judgement.faults) ++counts_[static_cast<int>(fault)];
    if (!judgement.faults.empty()) wrong_.push_back({&answer, std::move(judgement)});
  }

  // Asks again, with a certificate and the nearest double of the separation, and prints the wrong
  // answer.
  absl::Status Prove(const WrongAnswer& wrong) {
    v1::CheckCollisionRequest request;
    request.mutable_wanted()->set_separation(true);
    request.mutable_wanted()->set_max_error(0);
    request.mutable_wanted()->set_certificate(true);
    for (const size_t side : {size_t{0}, size_t{1}}) {
      v1::Placement& placement = side == 0 ? *request.mutable_a() : *request.mutable_b();
      placement = hulls_.placement(wrong.answer->names[side]);
      const auto& pose = wrong.answer->poses[side];
      const auto made = PoseFromNumbers({pose.begin(), pose.end()});
      if (!made.ok()) return made.status();
      *placement.mutable_pose() = *made;
    }
    const auto verified = CheckCollisionVerified(client_, request);
    if (!verified.ok()) return verified.status();
    if (verified->verification.verdict == Verdict::kInvalid) ++invalid_;
    AnswerRow row;
    row.relation = verified->response.relation();
    row.separation = verified->response.separation();
    Print({wrong.answer, Judge(*wrong.answer, row, max_error_)}, request, *verified);
    return absl::OkStatus();
  }

  void Print(const WrongAnswer& wrong, const v1::CheckCollisionRequest& request,
             const VerifiedResponse& proof) {
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
      const v1::CheckCollisionResponse& response = proof.response;
      run_.out << "line " << wrong.answer->line << "\t" << wrong.answer->names[0] << "\t"
               << wrong.answer->names[1] << "\t" << run_.paint(Hue::kBad, faults) << "\toff by "
               << ShortestText(wrong.judgement.error) << "\t"
               << PaintedRelation(response.relation(), run_.paint) << "\t"
               << SeparationText(response.separation()) << "\t"
               << VerificationText(proof.verification, run_.paint) << "\n";
    }
    run_.out << std::flush;
  }

  // Infinity is a string, as in the JSON mapping of proto3.
  static std::string JsonNumber(double number) {
    return std::isinf(number) ? QuoteJson("Infinity") : ShortestText(number);
  }

  void PrintSummary() {
    constexpr const char* kMembers[kFaults] = {"falseContacts", "misses", "touchingMistaken",
                                               "wrongDistances", "wrongDepths"};
    if (run_.names()) return;
    if (run_.json()) {
      JsonObject object;
      object.Add("answers", uint64_t{answers_.size()}).Add("wrong", uint64_t{wrong_.size()});
      for (int i = 0; i < kFaults; ++i) object.Add(kMembers[i], counts_[i]);
      object.Add("failed", failed_)
          .AddJson("largestDistanceError", JsonNumber(distance_error_))
          .AddJson("largestDepthError", JsonNumber(depth_error_));
      run_.out << object.Close() << "\n";
      return;
    }
    run_.out << "# " << Counted(answers_.size(), "answer") << ", " << wrong_.size() << " wrong, "
             << failed_ << " failed\n#";
    for (int i = 0; i < kFaults; ++i) {
      run_.out << (i > 0 ? ", " : " ") << FaultName(static_cast<Fault>(i)) << " " << counts_[i];
    }
    run_.out << "\n# largest error of a distance " << ShortestText(distance_error_)
             << ", of a depth " << ShortestText(depth_error_) << "\n";
  }

  const Invocation& run_;
  const std::vector<JudgedAnswer>& answers_;
  const JudgedHulls& hulls_;
  const double max_error_;
  const Client client_;
  ProgressBar bar_;
  std::vector<WrongAnswer> wrong_;
  uint64_t counts_[kFaults] = {};
  uint64_t failed_ = 0;
  uint64_t invalid_ = 0;
  double distance_error_ = 0;
  double depth_error_ = 0;
};

ExitCode JudgeTable(const Invocation& run, const JudgeArguments& arguments) {
  std::vector<std::string> ignored;
  const auto answers = ReadJudgedTable(arguments.file, &ignored);
  if (!answers.ok()) return run.FailUsage(answers.status());
  if (!ignored.empty()) {
    run.err << "hullctl: " << arguments.file
            << ": ignored columns: " << absl::StrJoin(ignored, ", ") << "\n";
  }
  JudgedHulls hulls;
  if (absl::Status resolved = hulls.Resolve(run, *answers); !resolved.ok()) {
    return run.FailUsage(resolved);
  }
  return JudgeRun(run, *answers, hulls, arguments.max_error).Run();
}

}  // namespace

void AddJudgeCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<JudgeArguments>();
  Command command = program.AddCommand("judge", "Find the wrong answers of another program");
  command.AddText("FILE", &arguments->file, "A table of answers, CSV; - is standard input")
      .Required()
      .Completes(ValueKind::kFile);
  command.AddLength("--max-error",
                    "Largest error that a distance or depth may have (default 0: as exact as the "
                    "proven bound)",
                    [data = arguments.get()](double length) { data->max_error = length; });
  AddFreshnessOptions(command, invocation);
  command.SetDetails(
      "The table has a header of column names, in any order, then a row for each answer:\n"
      "  a, b                    IDs of hulls or bodies, or files with points\n"
      "  a_x, a_y, a_z           translation of a (default 0), likewise b_x and so on\n"
      "  a_qw, a_qx, a_qy, a_qz  quaternion of a (default identity), likewise b_qw and so on\n"
      "  relation                SEPARATED, TOUCHING, or OVERLAPPING\n"
      "  colliding               0 or 1, of a program that does not tell touching from "
      "overlapping\n"
      "  distance                0 or more; a negative one is minus a depth\n"
      "  depth                   0 or more\n"
      "An empty cell is no answer. Other columns are ignored, with a note. Wrong answers are\n"
      "printed worst first, each with the exact relation, the separation, and the check of its\n"
      "certificate by hullctl's own exact arithmetic; with --output json, each line is a record\n"
      "for 'hullctl verify'. Exits with 1 if an answer is wrong.");
  command.SetExamples({{"", "hullctl judge answers.csv"},
                       {"Files, without a server; distances to a micrometer",
                        "hullctl judge answers.csv --local --max-error 1e-6"}});
  command.OnGiven(
      [=] { invocation->action = [=] { return JudgeTable(*invocation, *arguments); }; });
}

}  // namespace hulld
