#include <absl/strings/str_cat.h>

#include <memory>
#include <unordered_map>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

std::string ProblemJson(const v1::PairProblem& problem) {
  return JsonObject()
      .AddJson("code", std::to_string(problem.code()))
      .Add("message", problem.message())
      .Add("reason", v1::ErrorReason_Name(problem.reason()))
      .Close();
}

// The answer to one message, as one line.
absl::StatusOr<std::string> AnswerJson(const v1::StreamCollisionsResponse& answer) {
  const v1::AnswerColumns& columns = answer.columns();
  if (!AreParallel(columns, static_cast<size_t>(answer.pairs_size()))) {
    return absl::InternalError("the answer's columns and pairs disagree");
  }
  std::unordered_map<uint64_t, const v1::PairProblem*> problems;
  for (const v1::PairProblem& problem : columns.pair_problems()) problems[problem.row()] = &problem;
  std::string rows;
  for (int i = 0; i < answer.pairs_size(); ++i) {
    JsonObject row;
    row.AddJson("pair", std::to_string(answer.pairs(i)));
    AddRow(RowAt(columns, i), &row);
    const auto problem = problems.find(static_cast<uint64_t>(i));
    if (problem != problems.end()) row.AddJson("problem", ProblemJson(*problem->second));
    absl::StrAppend(&rows, i > 0 ? "," : "", row.Close());
  }
  std::string placement_problems;
  for (const v1::PlacementProblem& problem : answer.placement_problems()) {
    absl::StrAppend(&placement_problems, placement_problems.empty() ? "" : ",",
                    MessageJson(problem));
  }
  JsonObject line;
  line.Add("update", answer.update()).Add("revision", answer.header().revision());
  line.AddJson("answers", "[" + rows + "]");
  if (!placement_problems.empty()) {
    line.AddJson("placementProblems", "[" + placement_problems + "]");
  }
  return line.Close();
}

// The next line that is not blank.
bool NextLine(ByteSource* source, std::string* text) {
  std::string_view line;
  while (source->ReadLine(&line)) {
    if (Trim(line).empty()) continue;
    *text = std::string(line);
    return true;
  }
  return false;
}

ExitCode Stream(const Invocation& run, const std::string& path) {
  const auto source = ByteSource::Open(path);
  if (!source.ok()) return run.FailUsage(source.status());
  const auto at_line = [&](const absl::Status& status) {
    return (*source)->ErrorAtLine(std::string(status.message().data(), status.message().size()));
  };
  const Client client = run.MakeClient();
  std::unique_ptr<CollisionStream> stream;
  std::string text;
  while (NextLine(source->get(), &text)) {
    v1::CollisionStreamOpen open;
    v1::CollisionStreamUpdate update;
    const bool first = stream == nullptr;
    const absl::Status parsed = first ? ParseJson(text, UnknownFields::kRefuse, &open)
                                      : ParseJson(text, UnknownFields::kRefuse, &update);
    if (!parsed.ok()) return run.FailUsage(at_line(parsed));
    if (first) stream = client.OpenCollisionStream();
    const auto answer = first ? stream->Open(std::move(open)) : stream->Update(std::move(update));
    if (!answer.ok()) return run.Fail(answer.status());
    const auto json = AnswerJson(*answer);
    if (!json.ok()) return run.Fail(json.status());
    run.out << *json << "\n" << std::flush;
  }
  if (!(*source)->status().ok()) return run.FailUsage((*source)->status());
  if (stream == nullptr) {
    return run.FailUsage(absl::InvalidArgumentError(
        absl::StrCat(path, ": the first line must say what the stream is about; see --help")));
  }
  const absl::Status closed = stream->Close();
  return closed.ok() ? ExitCode::kDone : run.Fail(closed);
}

}  // namespace

void AddStreamCommand(Command program, Invocation* invocation) {
  auto path = std::make_shared<std::string>();
  Command command = program.AddCommand("stream", "Ask again and again while poses change");
  command.AddText("FILE", path.get(), "JSON, one object per line; - is standard input").Required();
  command.SetFooter(
      "The first line is a CollisionStreamOpen of the contract, each other line a\n"
      "CollisionStreamUpdate; each is answered by one line of JSON before the next is read.\n"
      "Poses are seven numbers for each placement named: quaternion w x y z, translation x y z.\n"
      "Only pairs with a placement that moved are answered; with \"onlyChanges\":true only those\n"
      "of them whose relation changed. --timeout bounds the wait for each answer. For example:\n"
      "  {\"placements\":[{\"hullId\":\"arm\"},{\"hullId\":\"box\"}],\"pairs\":[0,1]}\n"
      "  {\"placements\":[1],\"poses\":[1,0,0,0, 0.5,0,0]}\n"
      "  {\"placements\":[1],\"poses\":[1,0,0,0, 0.6,0,0],\"refreshHulls\":true}");
  command.OnGiven([=] { invocation->action = [=] { return Stream(*invocation, *path); }; });
}

}  // namespace hulld
