#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <unordered_map>

#include "client/hullctl/answer_text.h"
#include "client/hullctl/batch_file.h"
#include "client/hullctl/commands.h"
#include "client/hullctl/json.h"

namespace hulld {
namespace {

struct BatchArguments {
  std::string file;
  bool textbook = false;
  bool axis = false;
  bool report = false;
  bool colliding = false;
};

struct Problem {
  int code = 0;
  std::string message;
};

// Asks in calls of bounded size, each with only the placements that its pairs need, and prints
// answers as they come.
class BatchRun {
 public:
  BatchRun(const Invocation& run, const BatchArguments& arguments, const BatchScene& scene)
      : run_(run), arguments_(arguments), scene_(scene), client_(run.MakeClient()) {}

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
    if (arguments_.textbook) request.set_method(v1::METHOD_TEXTBOOK_SAT);
    request.mutable_wanted()->set_axis(arguments_.axis);
    request.mutable_wanted()->set_analysis(arguments_.report);
    request_ = &request;
    placement_problems_.clear();
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
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      placement_problems_[problem.placement()] = {problem.code(), problem.message()};
    }
    std::unordered_map<uint64_t, Problem> pair_problems;
    for (const v1::PairProblem& problem : part.pair_problems()) {
      pair_problems[problem.pair()] = {problem.code(), problem.message()};
    }
    const size_t count = static_cast<size_t>(part.relations_size());
    if (count == 0) return absl::OkStatus();
    const auto fits = [count](int size) { return size == 0 || static_cast<size_t>(size) == count; };
    if (begin + part.first_pair() != *next || count > end - *next || !fits(part.rungs_size()) ||
        !fits(part.axes_size()) || !fits(part.analyses_size())) {
      return absl::InternalError("the answers do not follow one another");
    }
    for (size_t i = 0; i < count; ++i, ++*next) {
      const Problem* problem = nullptr;
      if (part.relations(static_cast<int>(i)) == v1::RELATION_UNSPECIFIED) {
        problem = FindProblem(pair_problems, *next - begin);
        ++failed_;
      }
      Print(part, static_cast<int>(i), scene_.pairs[*next], problem);
    }
    return absl::OkStatus();
  }

  const Problem* FindProblem(const std::unordered_map<uint64_t, Problem>& pair_problems,
                             size_t pair) const {
    static const Problem* const kUnknown = new Problem{0, "the server gave no cause"};
    if (const auto found = pair_problems.find(pair); found != pair_problems.end()) {
      return &found->second;
    }
    for (const size_t side : {2 * pair, 2 * pair + 1}) {
      const auto found = placement_problems_.find(request_->pairs(static_cast<int>(side)));
      if (found != placement_problems_.end()) return &found->second;
    }
    return kUnknown;
  }

  void Print(const v1::BatchCheckCollisionsResponse& part, int i,
             const std::pair<uint32_t, uint32_t>& pair, const Problem* problem) {
    const v1::Relation relation = part.relations(i);
    ++counts_[relation];
    if (arguments_.colliding && relation == v1::RELATION_SEPARATED) return;
    const std::string& a = scene_.names[pair.first];
    const std::string& b = scene_.names[pair.second];
    const v1::Axis* const axis = part.axes_size() > 0 ? &part.axes(i) : nullptr;
    const v1::Analysis* const analysis = part.analyses_size() > 0 ? &part.analyses(i) : nullptr;
    if (run_.json) {
      run_.out << (printed_++ > 0 ? ",\n" : "\n") << Json(part, i, a, b, problem);
      return;
    }
    run_.out << a << "\t" << b << "\t" << (problem != nullptr ? "FAILED" : RelationText(relation));
    if (problem != nullptr) {
      run_.out << "\t" << problem->message << "\n";
      return;
    }
    if (axis != nullptr) {
      const bool found = axis->kind() != v1::AXIS_KIND_UNSPECIFIED;
      run_.out << "\t"
               << (found ? AxisKindText(axis->kind()) + " " + DirectionText(axis->direction())
                         : "no axis");
    }
    if (analysis != nullptr) {
      run_.out << "\t" << DurationText(analysis->time()) << "\t" << analysis->axes_tested()
               << " axes\t" << StageText(*analysis);
    }
    run_.out << "\n";
  }

  static std::string Json(const v1::BatchCheckCollisionsResponse& part, int i, const std::string& a,
                          const std::string& b, const Problem* problem) {
    JsonObject object;
    object.Add("a", a).Add("b", b).Add("relation", v1::Relation_Name(part.relations(i)));
    if (part.rungs_size() > 0) object.Add("rung", v1::Rung_Name(part.rungs(i)));
    if (part.axes_size() > 0) object.AddJson("axis", MessageJson(part.axes(i)));
    if (part.analyses_size() > 0) object.AddJson("analysis", MessageJson(part.analyses(i)));
    if (problem != nullptr) {
      object.AddJson("problem", JsonObject()
                                    .AddJson("code", std::to_string(problem->code))
                                    .Add("message", problem->message)
                                    .Close());
    }
    return object.Close();
  }

  void PrintEnd(const absl::Status& status) {
    if (run_.json) {
      JsonObject summary;
      for (const auto& [name, relation] : kSummary) summary.Add(name, counts_[relation]);
      run_.out << "],\n\"complete\":" << (status.ok() ? "true" : "false")
               << ",\n\"summary\":" << summary.Close() << "}\n";
      return;
    }
    run_.out << "#";
    for (const auto& [name, relation] : kSummary)
      run_.out << " " << name << " " << counts_[relation];
    run_.out << "\n";
  }

  struct SummaryEntry {
    const char* name;
    v1::Relation relation;
  };
  static constexpr SummaryEntry kSummary[] = {{"separated", v1::RELATION_SEPARATED},
                                              {"touching", v1::RELATION_TOUCHING},
                                              {"overlapping", v1::RELATION_OVERLAPPING},
                                              {"failed", v1::RELATION_UNSPECIFIED}};

  const Invocation& run_;
  const BatchArguments& arguments_;
  const BatchScene& scene_;
  const Client client_;
  const v1::BatchCheckCollisionsRequest* request_ = nullptr;
  std::unordered_map<uint32_t, Problem> placement_problems_;
  std::unordered_map<int, uint64_t> counts_;
  uint64_t printed_ = 0;
  uint64_t failed_ = 0;
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
  if (batch.failed() == 0) return ExitCode::kDone;
  run.err << "hullctl: " << batch.failed() << " of " << scene->pairs.size()
          << " pairs have no answer; each names its cause\n";
  return ExitCode::kSomeFailed;
}

}  // namespace

void AddBatchCommand(CLI::App* app, Invocation* invocation) {
  auto arguments = std::make_shared<BatchArguments>();
  CLI::App* command = app->add_subcommand("batch", "Ask about many pairs from a file");
  command->add_option("FILE", arguments->file, "Placements and pairs; - is standard input")
      ->required();
  command->add_flag("--textbook", arguments->textbook,
                    "Use the textbook's separating-axis test instead of the certified search");
  command->add_flag("--axis", arguments->axis, "Also show the separating or touching axes");
  command->add_flag("--report", arguments->report,
                    "Also show time, axes tested and where separation was found");
  command->add_flag("--colliding", arguments->colliding, "Leave out the pairs that are separated");
  command->footer(kBatchFileHelp);
  command->callback([=] { invocation->action = [=] { return Batch(*invocation, *arguments); }; });
}

}  // namespace hulld
