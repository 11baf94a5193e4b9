#include <absl/strings/str_cat.h>

#include <memory>

#include "client/formats/byte_source.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/verify/answer_check.h"

namespace hulld {
namespace {

// The answer, and the question that stands in it as member "request".
struct RecordedAnswer {
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
};

absl::StatusOr<RecordedAnswer> ReadAnswer(const std::string& path) {
  const auto text = ReadText(path);
  if (!text.ok()) return text.status();
  RecordedAnswer answer;
  const absl::Status request = ParseMember(*text, "request", &answer.request);
  if (!request.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": ", request.message(),
                     "; write it with: hullctl check A B --certificate --output json"));
  }
  const absl::Status response = ParseJson(*text, UnknownFields::kIgnore, &answer.response);
  if (response.ok()) return answer;
  return absl::InvalidArgumentError(absl::StrCat(path, ": ", response.message()));
}

ExitCode Verify(const Invocation& run, const std::string& path) {
  const auto answer = ReadAnswer(path);
  if (!answer.ok()) return run.FailUsage(answer.status());
  const Client client = run.MakeClient();
  AnswerChecker checker(client);
  const v1::CheckCollisionResponse& response = answer->response;
  const auto verification =
      checker.Check({answer->request.a(), answer->request.b(), response.relation(),
                     response.certificate(), response.hull_a(), response.hull_b()});
  if (!verification.ok()) return run.Fail(verification.status());
  if (run.json) {
    run.out << VerificationJson(*verification) << "\n";
  } else {
    run.out << RelationText(response.relation()) << ": " << VerificationText(*verification) << "\n";
  }
  return run.Judge(*verification);
}

}  // namespace

void AddVerifyCommand(Command program, Invocation* invocation) {
  auto path = std::make_shared<std::string>();
  Command command =
      program.AddCommand("verify", "Check that a recorded answer's certificate proves it");
  command.AddText("FILE", path.get(), "The answer; - is standard input").Required();
  command.SetFooter(
      "FILE is what `hullctl check A B --certificate --output json` prints. The vertices are\n"
      "fetched from the server, the arithmetic is exact and shares no code with it. An answer\n"
      "about a hull that has changed since cannot be checked, which is not the same as wrong:\n"
      "ask again, or let `hullctl check --verify` do both at once. For example:\n"
      "  hullctl check arm box --certificate --output json | hullctl verify -");
  command.OnGiven([=] { invocation->action = [=] { return Verify(*invocation, *path); }; });
}

}  // namespace hulld
