#include <absl/strings/str_cat.h>

#include <memory>
#include <optional>
#include <unordered_map>

#include "client/hullctl/command_line/batch_file.h"
#include "client/hullctl/command_line/query_options.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/verify/answer_check.h"

namespace hulld {
namespace {

struct BatchArguments {
  std::string file;
  QueryWishes wishes;
  bool colliding = false;
};

struct Problem {
  int code = 0;
  std::string message;
  v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED;
};

// Asks in calls of bounded size, each with only the placements that its pairs need, and prints
// answers as they come.
class BatchRun {
 public:
  BatchRun(const Invocation& run, const BatchArguments& arguments, const BatchScene& scene)
      : run_(run),
        arguments_(arguments),
        scene_(scene),
        client_(run.MakeClient()),
        checker_(client_) {}

  absl::Status Run() {
    if (run_.json) run_.out << "{\"answers\":[";
    absl::Status status;
    for (size_t begin = 0; begin < scene_.pairs.size() && status.ok(); begin += kPairsPerCall) {
      status = Call(begin, std::min(begin + kPairsPerCall, scene_.pairs.size()));
    }
    PrintEnd(status);
    return status;
  }

  uint64_t failed() const { return failed_; }
  // Pairs whose certificates do not prove them, and pairs that could not be checked.
  uint64_t invalid() const { return invalid_; }
  uint64_t unchecked() const { return unchecked_; }

 private:
  static constexpr size_t kPairsPerCall = 100000;

  absl::Status Call(size_t begin, size_t end) {
    v1::BatchCheckCollisionsRequest request;
    std::unordered_map<uint32_t, uint32_t> local;
    const auto use = [&](uint32_t placement) {
      const auto [entry, added] = local.emplace(placement, request.placements_size());
      if (added) *request.add_placements() = scene_.placements[placement];
      request.add_pairs(entry->second);
    };
    for (size_t i = begin; i < end; ++i) {
      use(scene_.pairs[i].first);
      use(scene_.pairs[i].second);
    }
    request.set_method(arguments_.wishes.method);
    request.set_tolerance(arguments_.wishes.tolerance);
    *request.mutable_wanted() = arguments_.wishes.wanted;
    request_ = &request;
    placement_problems_.clear();
    head_.Clear();
    size_t next = begin;
    absl::Status status =
        client_.BatchCheckCollisions(request, [&](const v1::BatchCheckCollisionsResponse& part) {
          return Take(part, begin, end, &next);
        });
    if (status.ok() && next != end) {
      status = absl::InternalError("the answers end before the last pair");
    }
    return status;
  }

  absl::Status Take(const v1::BatchCheckCollisionsResponse& part, size_t begin, size_t end,
                    size_t* next) {
    if (part.has_header()) *head_.mutable_header() = part.header();
    head_.mutable_hulls()->MergeFrom(part.hulls());
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      placement_problems_[problem.placement()] = {problem.code(), problem.message(),
                                                  problem.reason()};
    }
    std::unordered_map<uint64_t, Problem> pair_problems;
    for (const v1::PairProblem& problem : part.columns().pair_problems()) {
      pair_problems[part.first_pair() + problem.row()] = {problem.code(), problem.message(),
                                                          problem.reason()};
    }
    const size_t count = static_cast<size_t>(part.columns().relations_size());
    if (count == 0) return absl::OkStatus();
    if (begin + part.first_pair() != *next || count > end - *next ||
        !AreParallel(part.columns(), count)) {
      return absl::InternalError("the answers do not follow one another");
    }
    for (size_t i = 0; i < count; ++i, ++*next) {
      const AnswerRow row = RowAt(part.columns(), static_cast<int>(i));
      const Problem* problem = nullptr;
      std::optional<Verification> verification;
      if (row.relation == v1::RELATION_UNSPECIFIED) {
        problem = FindProblem(pair_problems, *next - begin);
        ++failed_;
      } else if (arguments_.wishes.verify) {
        auto verified = Verify(row, *next - begin);
        if (!verified.ok()) return verified.status();
        verification = *std::move(verified);
      }
      Print(row, scene_.pairs[*next], problem, verification);
    }
    return absl::OkStatus();
  }

  const Problem* FindProblem(const std::unordered_map<uint64_t, Problem>& pair_problems,
                             size_t pair) const {
    static const Problem* const kUnknown =
        new Problem{0, "the server gave no cause", v1::ERROR_REASON_UNSPECIFIED};
    if (const auto found = pair_problems.find(pair); found != pair_problems.end()) {
      return &found->second;
    }
    for (const size_t side : {2 * pair, 2 * pair + 1}) {
      const auto found = placement_problems_.find(request_->pairs(static_cast<int>(side)));
      if (found != placement_problems_.end()) return &found->second;
    }
    return kUnknown;
  }

  absl::StatusOr<Verification> Verify(const AnswerRow& row, size_t pair) {
    const uint32_t a = request_->pairs(static_cast<int>(2 * pair));
    const uint32_t b = request_->pairs(static_cast<int>(2 * pair + 1));
    const auto hulls = static_cast<uint32_t>(head_.hulls_size());
    if (a >= hulls || b >= hulls || row.certificate == nullptr) {
      return absl::InternalError("the answers lack the hulls or the certificates they are about");
    }
    auto verification =
        checker_.Check({request_->placements(static_cast<int>(a)),
                        request_->placements(static_cast<int>(b)), row.relation, *row.certificate,
                        head_.hulls(static_cast<int>(a)), head_.hulls(static_cast<int>(b))});
    if (!verification.ok()) return verification;
    if (verification->verdict == Verdict::kInvalid) {
      ++invalid_;
    } else if (verification->verdict != Verdict::kValid) {
      ++unchecked_;
    }
    return verification;
  }

  void Print(const AnswerRow& row, const std::pair<uint32_t, uint32_t>& pair,
             const Problem* problem, const std::optional<Verification>& verification) {
    ++counts_[row.relation];
    const bool as_expected = !verification || verification->verdict == Verdict::kValid;
    if (arguments_.colliding && row.relation == v1::RELATION_SEPARATED && as_expected) return;
    const std::string& a = scene_.names[pair.first];
    const std::string& b = scene_.names[pair.second];
    if (run_.json) {
      run_.out << (printed_++ > 0 ? ",\n" : "\n") << Json(row, a, b, problem, verification);
      return;
    }
    run_.out << a << "\t" << b << "\t";
    if (problem != nullptr) {
      run_.out << "FAILED\t" << problem->message << "\n";
      return;
    }
    run_.out << RowText(row);
    if (verification) run_.out << "\t" << VerificationText(*verification);
    run_.out << "\n";
  }

  static std::string Json(const AnswerRow& row, const std::string& a, const std::string& b,
                          const Problem* problem, const std::optional<Verification>& verification) {
    JsonObject object;
    object.Add("a", a).Add("b", b);
    AddRow(row, &object);
    if (verification) object.AddJson("verification", VerificationJson(*verification));
    if (problem != nullptr) {
      object.AddJson("problem", JsonObject()
                                    .AddJson("code", std::to_string(problem->code))
                                    .Add("message", problem->message)
                                    .Add("reason", v1::ErrorReason_Name(problem->reason))
                                    .Close());
    }
    return object.Close();
  }

  void PrintEnd(const absl::Status& status) {
    if (run_.json) {
      JsonObject summary;
      for (const SummaryEntry& entry : kSummary) {
        if (IsSummed(entry)) summary.Add(entry.name, counts_[entry.relation]);
      }
      run_.out << "],\n\"complete\":" << (status.ok() ? "true" : "false")
               << ",\n\"summary\":" << summary.Close() << "}\n";
      return;
    }
    run_.out << "#";
    for (const SummaryEntry& entry : kSummary) {
      if (IsSummed(entry)) run_.out << " " << entry.name << " " << counts_[entry.relation];
    }
    run_.out << "\n";
  }

  struct SummaryEntry {
    const char* name;
    v1::Relation relation;
  };
  static constexpr SummaryEntry kSummary[] = {{"separated", v1::RELATION_SEPARATED},
                                              {"touching", v1::RELATION_TOUCHING},
                                              {"overlapping", v1::RELATION_OVERLAPPING},
                                              {"within_tolerance", v1::RELATION_WITHIN_TOLERANCE},
                                              {"failed", v1::RELATION_UNSPECIFIED}};
  // A tolerance of 0 leaves no pair within it.
  bool IsSummed(const SummaryEntry& entry) const {
    return entry.relation != v1::RELATION_WITHIN_TOLERANCE || arguments_.wishes.tolerance > 0;
  }

  const Invocation& run_;
  const BatchArguments& arguments_;
  const BatchScene& scene_;
  const Client client_;
  AnswerChecker checker_;
  // The header and the hulls of the call that runs.
  v1::BatchCheckCollisionsResponse head_;
  const v1::BatchCheckCollisionsRequest* request_ = nullptr;
  std::unordered_map<uint32_t, Problem> placement_problems_;
  std::unordered_map<int, uint64_t> counts_;
  uint64_t printed_ = 0;
  uint64_t failed_ = 0;
  uint64_t invalid_ = 0;
  uint64_t unchecked_ = 0;
};

ExitCode Batch(const Invocation& run, const BatchArguments& arguments) {
  const auto source = ByteSource::Open(arguments.file);
  if (!source.ok()) return run.FailUsage(source.status());
  const auto scene = ReadBatchFile(source->get());
  if (!scene.ok()) return run.FailUsage(scene.status());
  if (scene->pairs.empty()) {
    return run.FailUsage(absl::InvalidArgumentError(
        absl::StrCat(arguments.file, ": no pair is asked for; add `pair NAME NAME` or `all`")));
  }
  BatchRun batch(run, arguments, *scene);
  if (absl::Status status = batch.Run(); !status.ok()) return run.Fail(status);
  const auto report = [&](uint64_t count, const char* what) {
    if (count == 0) return false;
    run.err << "hullctl: " << count << " of " << scene->pairs.size() << " pairs " << what << "\n";
    return true;
  };
  const bool failed = report(batch.failed(), "have no answer; each names its cause");
  const bool unchecked = report(batch.unchecked(), "could not be checked; each says why");
  const bool invalid = report(batch.invalid(), "have a certificate that does not prove them");
  return invalid     ? ExitCode::kInvalidCertificate
         : failed    ? ExitCode::kSomeFailed
         : unchecked ? ExitCode::kCannotCheck
                     : ExitCode::kDone;
}

}  // namespace

void AddBatchCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<BatchArguments>();
  Command command = program.AddCommand("batch", "Ask about many pairs from a file");
  command.AddText("FILE", &arguments->file, "Placements and pairs; - is standard input").Required();
  AddQueryOptions(command, &arguments->wishes);
  command.AddFlag("--colliding", &arguments->colliding, "Leave out the pairs that are separated");
  command.SetFooter(kBatchFileHelp);
  command.OnGiven([=] { invocation->action = [=] { return Batch(*invocation, *arguments); }; });
}

}  // namespace hulld
