
#include <deque>
#include <memory>
#include <optional>
#include <unordered_map>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/commands/scene_answers.h"
#include "client/hullctl/pairs/batch_answers.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/scene/scene_sync.h"
#include "client/verify/answer_check.h"
#include "client/verify/motion_check.h"

namespace hulld {
namespace {

struct BatchArguments {
  std::string file;
  QueryDetails details;
  bool colliding = false;
};

// Sends calls of bounded size and prints answers as they arrive. For a table, each call carries
// only the placements of its pairs. JSON messages name placements by index, so each call then
// carries all of them, and rows are numbered across calls.
class BatchRun {
 public:
  BatchRun(const Invocation& run, const BatchArguments& arguments, const Scene& scene,
           const std::vector<uint32_t>& pairs)
      : run_(run),
        arguments_(arguments),
        scene_(scene),
        pairs_(pairs),
        client_(run.MakeClient()),
        checker_(client_),
        bar_(run.err, run.shows_progress, "pairs", pairs.size() / 2) {
    *base_.mutable_wanted() = scene.request.wanted();
    base_.set_tolerance(scene.request.tolerance());
    arguments.details.Apply(&base_);
    const bool textbook = arguments.details.method != v1::METHOD_UNSPECIFIED;
    base_.set_method(textbook ? arguments.details.method : scene.method);
    if (!run.json()) return;
    *base_.mutable_placements() = scene.request.placements();
    if (scene.request.has_packed_placements()) {
      *base_.mutable_packed_placements() = scene.request.packed_placements();
    }
  }

  absl::Status Run() {
    absl::Status status;
    const size_t count = pairs_.size() / 2;
    for (size_t begin = 0; begin < count && status.ok(); begin += kPairsPerCall) {
      status = Call(begin, std::min(begin + kPairsPerCall, count));
    }
    bar_.Clear();
    if (!run_.json() && !run_.names()) PrintTotals();
    return status;
  }

  uint64_t failed() const { return failed_; }
  // Number of pairs with an invalid certificate, and of pairs that could not be checked.
  uint64_t invalid() const { return invalid_; }
  uint64_t unchecked() const { return unchecked_; }

 private:
  static constexpr size_t kPairsPerCall = 100000;

  // Returns the request for pairs [begin, end).
  v1::BatchCheckCollisionsRequest RequestFor(size_t begin, size_t end) const {
    v1::BatchCheckCollisionsRequest request = base_;
    if (run_.json()) {
      request.mutable_pairs()->Add(pairs_.begin() + static_cast<ptrdiff_t>(2 * begin),
                                   pairs_.begin() + static_cast<ptrdiff_t>(2 * end));
      return request;
    }
    std::unordered_map<uint32_t, uint32_t> local;
    for (size_t i = 2 * begin; i < 2 * end; ++i) {
      const auto [entry, added] = local.emplace(pairs_[i], request.placements_size());
      if (added) *request.add_placements() = scene_.PlacementOf(pairs_[i]);
      request.add_pairs(entry->second);
    }
    return request;
  }

  absl::Status Call(size_t begin, size_t end) {
    const v1::BatchCheckCollisionsRequest request = RequestFor(begin, end);
    request_ = &request;
    first_ = begin;
    head_.Clear();
    versions_.clear();
    piece_hulls_.clear();
    problems_.clear();
    return QueryBatch(
        client_, request,
        [&](const v1::BatchCheckCollisionsResponse& part) {
          TakeHead(part);
          if (run_.json()) PrintMessage(part);
          return absl::OkStatus();
        },
        [&](size_t pair, const AnswerRow& row, const std::string* problem) {
          return Take(pair, row, problem);
        });
  }

  void TakeHead(const v1::BatchCheckCollisionsResponse& part) {
    if (part.has_header()) *head_.mutable_header() = part.header();
    head_.mutable_hulls()->MergeFrom(part.hulls());
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      problems_[problem.placement()] = problem;
    }
    for (const v1::HullVersion& hull : part.piece_hulls()) {
      piece_hulls_.push_back(hull);
      versions_[hull.hull_id()] = &piece_hulls_.back();
    }
  }

  // pair: its index in the current call.
  absl::Status Take(size_t pair, const AnswerRow& row, const std::string* problem) {
    std::optional<Verification> verification;
    std::string text;
    if (problem != nullptr) {
      ++failed_;
      text = ProblemText(pair, *problem);
      problem = &text;
    } else if (arguments_.details.verify) {
      auto verified = Verify(row, pair);
      if (!verified.ok()) return verified.status();
      verification = *std::move(verified);
    }
    Print(row, first_ + pair, problem, verification);
    bar_.Update(first_ + pair + 1);
    return absl::OkStatus();
  }

  // Returns the message of a pair without an answer. pair: its index in the current call.
  std::string ProblemText(size_t pair, const std::string& message) const {
    for (const size_t side : {2 * pair, 2 * pair + 1}) {
      const auto found = problems_.find(request_->pairs(static_cast<int>(side)));
      if (found == problems_.end()) continue;
      return scene_.ProblemText(pairs_[2 * first_ + side], found->second);
    }
    return scene_.InKeys(message);
  }

  absl::StatusOr<Verification> Verify(const AnswerRow& row, size_t pair) {
    const v1::HullVersion* const a = VersionOf(request_->pairs(static_cast<int>(2 * pair)));
    const v1::HullVersion* const b = VersionOf(request_->pairs(static_cast<int>(2 * pair + 1)));
    if (a == nullptr || b == nullptr || row.certificate == nullptr) {
      return absl::InternalError(
          "the answers refer to hulls or certificates that they do not contain");
    }
    auto verification = CheckRow(row, first_ + pair, *a, *b);
    if (!verification.ok()) return verification;
    if (verification->verdict == Verdict::kInvalid) {
      ++invalid_;
    } else if (verification->verdict != Verdict::kValid) {
      ++unchecked_;
    }
    return verification;
  }

  // pair: its index across all calls.
  absl::StatusOr<Verification> CheckRow(const AnswerRow& row, size_t pair, const v1::HullVersion& a,
                                        const v1::HullVersion& b) {
    const v1::Placement at_a = scene_.PlacementOf(pairs_[2 * pair]);
    const v1::Placement at_b = scene_.PlacementOf(pairs_[2 * pair + 1]);
    if (row.proof == nullptr) {
      return checker_.Check(CheckedAnswer{at_a, at_b, row.relation, *row.certificate, a, b,
                                          row.first_contact ? &*row.first_contact : nullptr,
                                          MaxTimeError(base_.wanted())});
    }
    const auto [piece_a, piece_b] = row.pieces.value_or(std::pair(-1, -1));
    const auto index = [](int32_t piece) {
      return piece < 0 ? std::nullopt : std::optional(static_cast<uint32_t>(piece));
    };
    return checker_.Check(CheckedBodies{at_a, at_b, row.relation, a, b, row.proof->certificates(),
                                        versions_, index(piece_a), index(piece_b),
                                        row.first_contact ? &*row.first_contact : nullptr,
                                        MaxTimeError(base_.wanted())});
  }

  // Returns the hull of a placement of the request, empty for an inline shape; null if the answer
  // lacks it.
  const v1::HullVersion* VersionOf(uint32_t placement) const {
    const v1::PackedPlacements& packed = request_->packed_placements();
    if (packed.hulls_size() > 0) {
      placement = packed.hulls(static_cast<int>(placement));
      const bool is_shape = placement >= static_cast<uint32_t>(packed.hull_ids_size());
      if (is_shape) return &v1::HullVersion::default_instance();
    }
    const auto hulls = static_cast<uint32_t>(head_.hulls_size());
    return placement < hulls ? &head_.hulls(static_cast<int>(placement)) : nullptr;
  }

  // Prints the server's message, with rows numbered across calls.
  void PrintMessage(const v1::BatchCheckCollisionsResponse& part) {
    bar_.Clear();
    v1::BatchCheckCollisionsResponse message = part;
    message.set_first_pair(part.first_pair() + first_);
    run_.out << MessageJson(message) << "\n";
  }

  void Print(const AnswerRow& row, size_t pair, const std::string* problem,
             const std::optional<Verification>& verification) {
    ++counts_[row.relation];
    const bool as_expected = !verification || verification->verdict == Verdict::kValid;
    const uint32_t a = pairs_[2 * pair];
    const uint32_t b = pairs_[2 * pair + 1];
    if (run_.json()) {
      // The contract has no field for the verification.
      if (!as_expected) {
        run_.err << "hullctl: " << scene_.NameOf(a) << "\t" << scene_.NameOf(b) << "\t"
                 << VerificationText(*verification, Painter()) << "\n";
      }
      return;
    }
    if (arguments_.colliding && row.relation == v1::RELATION_SEPARATED && as_expected) return;
    bar_.Clear();
    PrintPair(run_, scene_, a, b, row, problem,
              verification ? "\t" + VerificationText(*verification, run_.paint) : "");
  }

  void PrintTotals() {
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
  // With a tolerance of 0, no pair is within it.
  bool IsSummed(const SummaryEntry& entry) const {
    return entry.relation != v1::RELATION_WITHIN_TOLERANCE || base_.tolerance() > 0;
  }

  const Invocation& run_;
  const BatchArguments& arguments_;
  const Scene& scene_;
  const std::vector<uint32_t>& pairs_;
  const Client client_;
  AnswerChecker checker_;
  ProgressBar bar_;
  // Fields common to all calls.
  v1::BatchCheckCollisionsRequest base_;
  // Header and hulls of the current call.
  v1::BatchCheckCollisionsResponse head_;
  // Hulls of the pieces of bodies, and their index by ID.
  std::deque<v1::HullVersion> piece_hulls_;
  HullVersions versions_;
  // Problems of the current call, by placement of its request.
  std::unordered_map<uint32_t, v1::PlacementProblem> problems_;
  const v1::BatchCheckCollisionsRequest* request_ = nullptr;
  // First pair of the current call.
  size_t first_ = 0;
  std::unordered_map<int, uint64_t> counts_;
  uint64_t failed_ = 0;
  uint64_t invalid_ = 0;
  uint64_t unchecked_ = 0;
};

ExitCode Batch(const Invocation& run, const BatchArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto scene,
                       ReadWholeScene(arguments.file, "batch", FormFor(arguments.details)));
  if (auto put = PutSceneIfLocal(run, arguments.file); !put.ok()) return run.Fail(put);
  return AnswerPairs(run, arguments.file, scene, arguments.details, arguments.colliding);
}

}  // namespace

void PrintPair(const Invocation& run, const Scene& scene, uint32_t a, uint32_t b,
               const AnswerRow& row, const std::string* problem, const std::string& suffix) {
  run.out << scene.NameOf(a) << "\t" << scene.NameOf(b) << "\t";
  if (problem != nullptr) {
    run.out << run.paint(Hue::kBad, "FAILED") << (run.names() ? "" : "\t" + *problem) << "\n";
  } else if (run.names()) {
    run.out << RelationText(row.relation) << "\n";
  } else {
    const auto pieces = scene.NamesOfPieces(a, b, row.pieces.value_or(std::pair(-1, -1)));
    run.out << RowText(row, run.paint, pieces) << suffix << "\n";
  }
}

BodyForm FormFor(const QueryDetails& details) {
  return details.method == v1::METHOD_TEXTBOOK_SAT ? BodyForm::kPieces : BodyForm::kWhole;
}

ExitCode AnswerPairs(const Invocation& run, const std::string& file, const Scene& scene,
                     const QueryDetails& details, bool colliding) {
  const BatchArguments arguments{file, details, colliding};
  if (colliding && run.json()) {
    return run.FailUsage(
        "--colliding cannot be combined with --output json, which prints every pair; use 'hullctl "
        "scene' to find colliding pairs");
  }
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto pairs, PairsOf(scene, file));
  BatchRun batch(run, arguments, scene, pairs);
  if (absl::Status status = batch.Run(); !status.ok()) return run.Fail(scene.InKeys(status));
  const auto report = [&](uint64_t count, const char* what) {
    if (count == 0) return false;
    run.err << "hullctl: " << count << " of " << pairs.size() / 2 << " pairs " << what << "\n";
    return true;
  };
  const bool failed = report(batch.failed(), "failed; each line gives the reason");
  const bool unchecked =
      report(batch.unchecked(), "could not be checked; each line gives the reason");
  const bool invalid = report(batch.invalid(), "have an invalid certificate");
  return invalid     ? ExitCode::kInvalidCertificate
         : failed    ? ExitCode::kSomeFailed
         : unchecked ? ExitCode::kCannotCheck
                     : ExitCode::kDone;
}

void AddBatchCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<BatchArguments>();
  Command command = program.AddCommand("batch", "Check many pairs of a scene file");
  command.AddText("FILE", &arguments->file, "The scene; - is standard input").Required();
  AddQueryOptions(command, &arguments->details);
  command.AddFlag("--colliding", &arguments->colliding, "Omit separated pairs");
  AddFreshnessOptions(command, invocation);
  command.SetDetails(kSceneFileHelp);
  command.SetExamples(
      {{"", "hullctl batch scene.yaml"},
       {"Only colliding pairs, with verified certificates",
        "hullctl batch scene.yaml --colliding --verify"},
       {"As messages of the contract, one per line", "hullctl batch scene.yaml --output json"}});
  OnGiven(command, invocation, arguments, Batch);
}

}  // namespace hulld
