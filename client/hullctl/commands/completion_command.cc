// `completion`, and the hidden command that writes man pages.
#include <absl/strings/str_cat.h>

#include <filesystem>
#include <memory>
#include <string>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/completion/completion.h"
#include "client/hullctl/help/man_page.h"

namespace hulld {
namespace {

ExitCode PrintScript(const Invocation& run, const std::string& shell) {
  run.out << CompletionScript(shell);
  return ExitCode::kDone;
}

// Returns the sections of the program's man page beyond its help.
std::vector<ManSection> ProgramSections() {
  std::string variables;
  for (const ConnectionSetting& setting : kConnectionSettings) {
    if (setting.variable == nullptr) continue;
    absl::StrAppend(&variables, "  ", setting.variable,
                    std::string(22 - std::string(setting.variable).size(), ' '), "as --",
                    setting.name, "\n");
  }
  absl::StrAppend(&variables,
                  "  HULLCTL_CONTEXT       as --context\n"
                  "  HULLD_TOKEN           the token itself\n"
                  "  NO_COLOR              no colors, unless --color is given");
  return {{"environment", variables},
          {"files", "  $XDG_CONFIG_HOME/hullctl/contexts.json   contexts: see hullctl-context(1)"}};
}

ExitCode WriteManPages(const Invocation& run, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const CommandDescription& program = *run.program;
  const auto write = [&](const CommandDescription& command,
                         const std::vector<ManSection>& sections) {
    return run.WriteFile(absl::StrCat(folder, "/", ManPageName(command)), [&](std::ostream& out) {
      out << ManPage(program, command, HULLD_VERSION, sections);
    });
  };
  ExitCode written = write(program, ProgramSections());
  for (const auto& command : program.commands) {
    if (written == ExitCode::kDone && !command->hidden) written = write(*command, {});
  }
  return written;
}

}  // namespace

void AddCompletionCommand(Command program, Invocation* invocation) {
  auto shell = std::make_shared<std::string>();
  Command command = program.AddCommand("completion", "Print the completion script for a shell");
  command.AddText("SHELL", shell.get(), "The shell").Required().OneOf({"bash", "zsh", "fish"});
  command.SetDetails(
      "The script completes commands, options, values, names of contexts, and IDs of hulls. For\n"
      "IDs it queries the server, for half a second at most and without error messages.");
  command.SetExamples({{"In ~/.bashrc", "source <(hullctl completion bash)"},
                       {"In ~/.zshrc, after compinit", "source <(hullctl completion zsh)"},
                       {"In ~/.config/fish/config.fish", "hullctl completion fish | source"}});
  OnGiven(command, invocation, shell, PrintScript, /*needs_server=*/false);
}

void AddManCommand(Command program, Invocation* invocation) {
  auto folder = std::make_shared<std::string>();
  Command command = program.AddCommand("__man", "Write the manual pages");
  command.AddText("FOLDER", folder.get(), "Directory to write to").Required();
  command.Hide();
  OnGiven(command, invocation, folder, WriteManPages, /*needs_server=*/false);
}

}  // namespace hulld
