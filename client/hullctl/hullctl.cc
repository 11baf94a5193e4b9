#include "client/hullctl/hullctl.h"

#include <absl/strings/str_cat.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/connection.h"
#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/completion/completion.h"
#include "client/hullctl/local/local_server.h"

namespace hulld {
namespace {

void AddOutputOptions(Command program, Invocation* invocation) {
  program
      .AddChoice("--output",
                 {{"table", OutputForm::kTable},
                  {"wide", OutputForm::kWide},
                  {"name", OutputForm::kName},
                  {"json", OutputForm::kJson}},
                 &invocation->form, "Format of answers (default table)")
      .ValueName("FORM");
  program
      .AddParsed(
          "--color",
          [invocation](const std::string& when) {
            const bool terminal = &invocation->out == &std::cout && isatty(STDOUT_FILENO) != 0;
            invocation->paint = Painter(WantsColor(when, terminal));
            return absl::OkStatus();
          },
          "Use of colors (default auto: on a terminal, unless $NO_COLOR is set)")
      .ValueName("WHEN")
      .OneOf({"auto", "always", "never"});
}

void AddGlobalOptions(Command program, Invocation* invocation) {
  AddConnectionOptions(program, invocation);
  program
      .AddParsed(
          "--timeout", ParseDuration, &invocation->given_timeout,
          "Time to wait for an answer, such as 500ms or 2m (default 30s; none for 'replace' and "
          "'backup save'). An unreachable server is retried during this time; by default, for less "
          "than a second")
      .ValueName("TIME");
  AddOutputOptions(program, invocation);
}

// Groups of the help, and their commands. A new command adds a line here and a declaration in
// command_line/commands.h; the rest is in its own file.
void AddCommands(Command program, Invocation* invocation) {
  program.BeginGroup("Build hulls");
  AddCreateCommand(program, invocation);
  AddAppendCommand(program, invocation);
  AddReplaceCommand(program, invocation);
  AddDeleteCommand(program, invocation);
  AddBodyCommand(program, invocation);
  program.BeginGroup("Inspect hulls");
  AddListCommand(program, invocation);
  AddGetCommand(program, invocation);
  AddMeshCommand(program, invocation);
  AddViewCommand(program, invocation);
  program.BeginGroup("Check for collision");
  AddCheckCommand(program, invocation);
  AddCastCommand(program, invocation);
  AddBatchCommand(program, invocation);
  AddSceneCommand(program, invocation);
  AddStreamCommand(program, invocation);
  AddRobotCommand(program, invocation);
  AddCoverCommand(program, invocation);
  AddVerifyCommand(program, invocation);
  AddJudgeCommand(program, invocation);
  AddWatchCommand(program, invocation);
  program.BeginGroup("Run a server");
  AddStatusCommand(program, invocation);
  AddHealthCommand(program, invocation);
  AddBackupCommand(program, invocation);
  AddTokenCommand(program, invocation);
  AddBenchCommand(program, invocation);
  program.BeginGroup("Work with hullctl");
  AddContextCommand(program, invocation);
  AddCompletionCommand(program, invocation);
  AddGenerateCommand(program, invocation);
  AddManCommand(program, invocation);
  program.RequireCommand();
}

// Rewrites "help check" to "check --help".
std::vector<std::string> WithoutHelpCommand(std::vector<std::string> arguments) {
  if (arguments.empty() || arguments.front() != "help") return arguments;
  arguments.erase(arguments.begin());
  arguments.emplace_back("--help");
  return arguments;
}

void AddProgram(Command program, Invocation* invocation) {
  program.SetDetails(std::string(kExitCodeHelp) +
                     "\nJSON follows the mapping of proto3: 64-bit integers are strings.");
  program.SetExamples({{"A server, a hull, a query", "hulld --data-dir hulls &"},
                       {"", "hullctl generate lattice 27 | hullctl append cube - --create"},
                       {"", "hullctl check cube cube --pose-b 2,0,0"}});
  AddGlobalOptions(program, invocation);
  AddCommands(program, invocation);
}

// Prints the completions of the last word, for a shell.
int CompleteWords(const std::vector<std::string>& words, CommandLine* command_line,
                  Invocation* invocation) {
  // Connection options; without them no IDs are offered.
  std::vector<std::string> options = ProgramOptionsIn(command_line->description(), words);
  options.emplace_back("health");
  std::ostringstream ignored;
  const bool understood = !command_line->Parse(options, ignored, ignored).has_value();
  const ValueSource values =
      understood
          ? ValuesFor(invocation)
          : ValueSource([](ValueKind, const std::string&) { return std::vector<Candidate>(); });
  const Completion completion = Complete(command_line->description(), words, values);
  for (const Candidate& candidate : completion.candidates) {
    invocation->out << candidate.text;
    if (!candidate.help.empty()) invocation->out << "\t" << candidate.help;
    invocation->out << "\n";
  }
  invocation->out << (completion.files         ? ":files"
                      : completion.directories ? ":directories"
                                               : ":")
                  << "\n";
  return static_cast<int>(ExitCode::kDone);
}

// Starts the server of --local.
absl::StatusOr<std::unique_ptr<LocalServer>> StartLocal(Invocation* invocation) {
  const ConnectionSettings& flags = invocation->flags;
  if (!flags.empty() || !invocation->context.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("--local starts a server of its own; remove --",
                     flags.empty() ? "context" : flags.begin()->first));
  }
  auto server = LocalServer::Start();
  if (server.ok()) invocation->server = (*server)->address();
  return server;
}

// Returns true if standard output is a pipe without a reader, such as an ended `head`.
bool IsPipeClosed() {
  pollfd output = {STDOUT_FILENO, 0, 0};
  return poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

// Returns the exit code, or kUsage if the output could not be written. If its reader has ended, so
// does the program, silently, as other programs do.
ExitCode Flush(const Invocation& invocation, ExitCode code) {
  invocation.out.flush();
  if (invocation.out) return code;
  if (&invocation.out == &std::cout && IsPipeClosed()) {
    std::signal(SIGPIPE, SIG_DFL);
    std::raise(SIGPIPE);
  }
  invocation.err << "hullctl: cannot write the answer: the disk is full, or the output is closed\n";
  return ExitCode::kUsage;
}

ExitCode RunAction(Invocation* invocation) {
  std::unique_ptr<LocalServer> local;
  if (invocation->needs_server && invocation->local) {
    HULLD_ASSIGN_OR_FAIL(invocation->FailUsage, local, StartLocal(invocation));
  } else if (invocation->needs_server) {
    const absl::Status resolved = ResolveConnection(invocation);
    if (!resolved.ok()) return invocation->FailUsage(resolved);
  }
  // Machine-readable output has no colors.
  if (invocation->json() || invocation->names()) invocation->paint = Painter();
  return invocation->action();
}

}  // namespace

int RunHullctl(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) {
  CommandLine command_line("hullctl", HULLD_VERSION,
                           "Manages convex hulls on a hulld server and checks them for collision.");
  Invocation invocation(out, err);
  invocation.paint = Painter(WantsColor("auto", &out == &std::cout && isatty(STDOUT_FILENO) != 0));
  invocation.shows_progress = &err == &std::cerr && isatty(STDERR_FILENO) != 0;
  AddProgram(command_line.root(), &invocation);
  if (!arguments.empty() && arguments.front() == kCompleteCommand) {
    return CompleteWords({arguments.begin() + 1, arguments.end()}, &command_line, &invocation);
  }
  const std::optional<ExitCode> ended = command_line.Parse(WithoutHelpCommand(arguments), out, err);
  invocation.program = &command_line.description();
  return static_cast<int>(Flush(invocation, ended.has_value() ? *ended : RunAction(&invocation)));
}

}  // namespace hulld
