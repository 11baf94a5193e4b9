#include <absl/strings/str_cat.h>

#include <memory>

#include "client/formats/byte_source.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/verify/answer_check.h"

namespace hulld {
namespace {

// A query and its answer.
struct RecordedAnswer {
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
};

absl::StatusOr<RecordedAnswer> ReadAnswer(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const auto text, ReadText(path));
  RecordedAnswer answer;
  absl::Status parsed = ParseMember(text, "request", &answer.request);
  if (parsed.ok()) parsed = ParseMember(text, "response", &answer.response);
  if (parsed.ok()) return answer;
  return absl::InvalidArgumentError(absl::StrCat(
      path, ": ", parsed.message(), "; write it with: hullctl check A B --record FILE"));
}

ExitCode Verify(const Invocation& run, const std::string& path) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto answer, ReadAnswer(path));
  const Client client = run.MakeClient();
  AnswerChecker checker(client);
  const v1::CheckCollisionResponse& response = answer.response;
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto verification, checker.Check(answer.request, response));
  if (!run.PrintForPrograms(VerificationJson(verification), RelationText(response.relation()))) {
    run.out << PaintedRelation(response.relation(), run.paint) << ": "
            << VerificationText(verification, run.paint) << "\n";
  }
  return run.Judge(verification);
}

}  // namespace

void AddVerifyCommand(Command program, Invocation* invocation) {
  auto path = std::make_shared<std::string>();
  Command command = program.AddCommand("verify", "Check the certificate of a recorded answer");
  command.AddText("FILE", path.get(), "The answer; - is standard input").Required();
  command.SetDetails(
      "FILE is written by 'hullctl check A B --record FILE'. The vertices come from the server;\n"
      "the check is in exact arithmetic and shares no code with it. If a hull has changed since\n"
      "then, the answer cannot be checked, which does not mean that it is wrong. To check an\n"
      "answer immediately, use 'hullctl check --verify'.");
  command.SetExamples(
      {{"", "hullctl check arm box --record answer.json"}, {"", "hullctl verify answer.json"}});
  OnGiven(command, invocation, path, Verify);
}

}  // namespace hulld
