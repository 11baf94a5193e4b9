#include "client/hullctl/hullctl.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/connection_options.h"
#include "client/hullctl/command_line/exit_code.h"
#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/commands/commands.h"

namespace hulld {
namespace {

std::string Message(const absl::Status& status) {
  return std::string(status.message().data(), status.message().size());
}

void AddGlobalOptions(CLI::App* app, Invocation* invocation) {
  app->set_version_flag("--version", std::string("hullctl ") + HULLD_VERSION);
  app->add_option_function<std::string>(
         "-s,--server",
         [invocation](const std::string& server) {
           const absl::Status status = ValidateServer(server);
           if (!status.ok()) throw CLI::ValidationError("--server", Message(status));
           invocation->server = server;
         },
         std::string("Where hulld listens (default ") + kDefaultServer + ")")
      ->type_name("HOST:PORT")
      ->envname("HULLCTL_SERVER");
  app->add_option_function<std::string>(
         "--timeout",
         [invocation](const std::string& text) {
           const auto timeout = ParseDuration(text);
           if (!timeout.ok()) throw CLI::ValidationError("--timeout", Message(timeout.status()));
           invocation->timeout = *timeout;
           invocation->given_timeout = *timeout;
         },
         "How long to wait for an answer, such as 500ms or 2m (default 30s; 'replace' and "
         "'backup save' take the time that they need unless it is given)")
      ->type_name("TIME");
  app->add_option_function<std::string>(
         "--output", [invocation](const std::string& kind) { invocation->json = kind == "json"; },
         "How answers are printed (default table)")
      ->type_name("table|json")
      ->check(CLI::IsMember({"table", "json"}));
  AddConnectionOptions(app, invocation);
}

void AddCommands(CLI::App* app, Invocation* invocation) {
  AddCreateCommand(app, invocation);
  AddAppendCommand(app, invocation);
  AddReplaceCommand(app, invocation);
  AddGetCommand(app, invocation);
  AddListCommand(app, invocation);
  AddDeleteCommand(app, invocation);
  AddMeshCommand(app, invocation);
  AddCheckCommand(app, invocation);
  AddBatchCommand(app, invocation);
  AddSceneCommand(app, invocation);
  AddStreamCommand(app, invocation);
  AddVerifyCommand(app, invocation);
  AddGenerateCommand(app, invocation);
  AddStatusCommand(app, invocation);
  AddBackupCommand(app, invocation);
  AddBenchCommand(app, invocation);
  AddPictureCommand(app, invocation);
  AddTokenCommand(app, invocation);
  app->require_subcommand(1);
  // Global options may stand behind the command, too.
  for (CLI::App* command : app->get_subcommands({})) command->fallthrough();
}

}  // namespace

int RunHullctl(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) {
  CLI::App app("Keeps convex hulls on a hulld server and asks it whether they collide.", "hullctl");
  app.footer(std::string(kExitCodeHelp) +
             "\nJSON output follows the mapping of proto3: 64-bit integers are strings.");
  Invocation invocation(out, err);
  AddGlobalOptions(&app, &invocation);
  AddCommands(&app, &invocation);
  // CLI11 takes the arguments from the back.
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    if (app.exit(error, out, err) == 0) return static_cast<int>(ExitCode::kDone);
    return static_cast<int>(ExitCode::kUsage);
  }
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
