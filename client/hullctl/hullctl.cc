#include "client/hullctl/hullctl.h"

#include <optional>

#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/connection_options.h"
#include "client/hullctl/command_line/exit_code.h"
#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/commands/commands.h"

namespace hulld {
namespace {

void AddGlobalOptions(Command program, Invocation* invocation) {
  program
      .AddParsed(
          "-s,--server",
          [invocation](const std::string& server) {
            const absl::Status status = ValidateServer(server);
            if (status.ok()) invocation->server = server;
            return status;
          },
          std::string("Where hulld listens (default ") + kDefaultServer + ")")
      .ValueName("HOST:PORT")
      .Environment("HULLCTL_SERVER");
  program
      .AddParsed(
          "--timeout",
          [invocation](const std::string& text) {
            const auto timeout = ParseDuration(text);
            if (!timeout.ok()) return timeout.status();
            invocation->timeout = *timeout;
            invocation->given_timeout = *timeout;
            return absl::OkStatus();
          },
          "How long to wait for an answer, such as 500ms or 2m (default 30s; 'replace' and "
          "'backup save' take the time that they need unless it is given)")
      .ValueName("TIME");
  program
      .AddParsed(
          "--output",
          [invocation](const std::string& kind) {
            invocation->json = kind == "json";
            return absl::OkStatus();
          },
          "How answers are printed (default table)")
      .ValueName("table|json")
      .OneOf({"table", "json"});
  AddConnectionOptions(program, invocation);
}

void AddCommands(Command program, Invocation* invocation) {
  AddCreateCommand(program, invocation);
  AddAppendCommand(program, invocation);
  AddReplaceCommand(program, invocation);
  AddGetCommand(program, invocation);
  AddListCommand(program, invocation);
  AddDeleteCommand(program, invocation);
  AddMeshCommand(program, invocation);
  AddCheckCommand(program, invocation);
  AddBatchCommand(program, invocation);
  AddSceneCommand(program, invocation);
  AddStreamCommand(program, invocation);
  AddVerifyCommand(program, invocation);
  AddWatchCommand(program, invocation);
  AddGenerateCommand(program, invocation);
  AddStatusCommand(program, invocation);
  AddBackupCommand(program, invocation);
  AddBenchCommand(program, invocation);
  AddPictureCommand(program, invocation);
  AddViewCommand(program, invocation);
  AddTokenCommand(program, invocation);
  program.RequireCommand();
}

}  // namespace

int RunHullctl(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) {
  CommandLine command_line(
      "hullctl", HULLD_VERSION,
      "Keeps convex hulls on a hulld server and asks it whether they collide.");
  Command program = command_line.root();
  program.SetFooter(std::string(kExitCodeHelp) +
                    "\nJSON output follows the mapping of proto3: 64-bit integers are strings.");
  Invocation invocation(out, err);
  AddGlobalOptions(program, &invocation);
  AddCommands(program, &invocation);
  const std::optional<ExitCode> ended = command_line.Parse(arguments, out, err);
  if (ended.has_value()) return static_cast<int>(*ended);
  const absl::Status completed = CompleteConnectionOptions(&invocation);
  if (!completed.ok()) return static_cast<int>(invocation.FailUsage(completed));
  const ExitCode code = invocation.action();
  out.flush();
  if (!out) {
    err << "hullctl: cannot write the answer; is the disk full or the pipe closed?\n";
    return static_cast<int>(ExitCode::kUsage);
  }
  return static_cast<int>(code);
}

}  // namespace hulld
