#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/commands/scene_answers.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

struct StreamArguments {
  std::string file;
  QueryDetails details;
  bool only_changes = false;
};

// One stream: its scene, its answers, and their output.
class StreamRun {
 public:
  StreamRun(const Invocation& run, const Scene& scene, std::vector<uint32_t> pairs)
      : run_(run), scene_(scene), pairs_(std::move(pairs)) {}

  absl::Status Open(bool only_changes) {
    v1::CollisionStreamOpen open;
    *open.mutable_placements() = scene_.request.placements();
    if (scene_.request.has_packed_placements()) {
      *open.mutable_packed_placements() = scene_.request.packed_placements();
    }
    open.mutable_pairs()->Add(pairs_.begin(), pairs_.end());
    *open.mutable_wanted() = scene_.request.wanted();
    open.set_tolerance(scene_.request.tolerance());
    open.set_only_changes(only_changes);
    stream_ = run_.MakeClient().OpenCollisionStream();
    return Print(stream_->Open(std::move(open)));
  }

  absl::Status Update(v1::CollisionStreamUpdate update) {
    return Print(stream_->Update(std::move(update)));
  }

  absl::Status Close() { return stream_->Close(); }

 private:
  absl::Status Print(const absl::StatusOr<v1::StreamCollisionsResponse>& answer) {
    if (!answer.ok()) return answer.status();
    const v1::AnswerColumns& columns = answer->columns();
    if (!AreParallel(columns, static_cast<size_t>(answer->pairs_size()))) {
      return absl::InternalError("the answer's columns and pairs disagree");
    }
    for (const uint32_t pair : answer->pairs()) {
      if (pair < pairs_.size() / 2) continue;
      return absl::InternalError("the answer refers to a pair that does not exist");
    }
    if (run_.json()) {
      run_.out << MessageJson(*answer) << "\n" << std::flush;
      return absl::OkStatus();
    }
    if (answer->placement_problems_size() > 0 || answer->hulls_size() > 0) problems_.clear();
    for (const v1::PlacementProblem& problem : answer->placement_problems()) {
      problems_[problem.placement()] = scene_.ProblemText(problem.placement(), problem);
    }
    PrintRows(*answer);
    return absl::OkStatus();
  }

  void PrintRows(const v1::StreamCollisionsResponse& answer) {
    std::unordered_map<uint64_t, std::string> causes;
    for (const v1::PairProblem& problem : answer.columns().pair_problems()) {
      causes[problem.row()] = scene_.InKeys(problem.message());
    }
    for (int i = 0; i < answer.pairs_size(); ++i) {
      const uint32_t a = pairs_[2 * answer.pairs(i)];
      const uint32_t b = pairs_[2 * answer.pairs(i) + 1];
      const AnswerRow row = RowAt(answer.columns(), i);
      const bool is_answered = row.relation != v1::RELATION_UNSPECIFIED;
      const auto cause = causes.find(static_cast<uint64_t>(i));
      const std::string problem = is_answered             ? ""
                                  : cause != causes.end() ? cause->second
                                                          : ProblemOf(a, b);
      run_.out << answer.update() << "\t";
      PrintPair(run_, scene_, a, b, row, is_answered ? nullptr : &problem);
    }
    run_.out << std::flush;
  }

  std::string ProblemOf(uint32_t a, uint32_t b) const {
    for (const uint32_t placement : {a, b}) {
      const auto found = problems_.find(placement);
      if (found != problems_.end()) return found->second;
    }
    return "the server gave no reason";
  }

  const Invocation& run_;
  const Scene& scene_;
  const std::vector<uint32_t> pairs_;
  std::unique_ptr<CollisionStream> stream_;
  // Problems of placements without a hull, from the last answer that lists hulls.
  std::unordered_map<uint32_t, std::string> problems_;
};

// Reads the next line that is not blank.
bool NextLine(ByteSource* source, std::string* text) {
  std::string_view line;
  while (source->ReadLine(&line)) {
    if (Trim(line).empty()) continue;
    *text = std::string(line);
    return true;
  }
  return false;
}

ExitCode Stream(const Invocation& run, const StreamArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto source, ByteSource::Open(arguments.file));
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto scene, ReadScene(source.get()));
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto pairs, PairsOf(scene, arguments.file));
  arguments.details.Apply(&scene.request);
  StreamRun stream(run, scene, std::move(pairs));
  absl::Status status = stream.Open(scene.only_changes || arguments.only_changes);
  std::string text;
  while (status.ok() && run.out && NextLine(source.get(), &text)) {
    v1::CollisionStreamUpdate update;
    const absl::Status parsed = ParseJson(text, UnknownFields::kRefuse, &update);
    if (!parsed.ok()) {
      return run.FailUsage(source->ErrorAtLine(std::string(parsed.message())));
    }
    status = stream.Update(std::move(update));
  }
  if (!status.ok()) return run.Fail(scene.InKeys(status));
  if (!source->status().ok()) return run.FailUsage(source->status());
  status = stream.Close();
  return status.ok() ? ExitCode::kDone : run.Fail(scene.InKeys(status));
}

}  // namespace

void AddStreamCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<StreamArguments>();
  Command command = program.AddCommand("stream", "Check pairs repeatedly while poses change");
  command.AddText("FILE", &arguments->file, "A scene and updates; - is standard input").Required();
  AddWantedOptions(command, &arguments->details);
  command.AddFlag("--only-changes", &arguments->only_changes,
                  "Answer updates only with pairs whose relation changed");
  AddFreshnessOptions(command, invocation);
  command.SetDetails(
      "FILE starts with a scene, as for 'hullctl batch'. If the scene is JSON in braces, each\n"
      "line after it is a CollisionStreamUpdate of the contract, answered before the next is\n"
      "read. Poses are seven numbers for each placement named: quaternion w x y z, translation\n"
      "x y z. Only pairs with a placement that moved are answered. --timeout bounds the wait for\n"
      "each answer. A file:\n"
      "  {\"placements\":[{\"hullId\":\"arm\"},{\"hullId\":\"box\"}],\"pairs\":[0,1]}\n"
      "  {\"placements\":[1],\"poses\":[1,0,0,0, 0.5,0,0]}\n"
      "  {\"placements\":[1],\"poses\":[1,0,0,0, 0.6,0,0],\"refreshHulls\":true}");
  command.SetExamples({{"", "hullctl stream poses.jsonl"},
                       {"Contacts as they begin and end, as messages of the contract",
                        "simulator | hullctl stream - --only-changes --output json"}});
  OnGiven(command, invocation, arguments, Stream);
}

}  // namespace hulld
