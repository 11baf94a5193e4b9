#include <absl/strings/str_cat.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "client/hullctl/command_line/connection.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/completion/completion.h"
#include "client/hullctl/completion/completion_values.h"
#include "client/hullctl/shell/line_editor.h"
#include "client/hullctl/shell/word_splitting.h"

namespace hulld {
namespace {

// Returns $XDG_STATE_HOME/hullctl/history; without the variable, the file below ~/.local/state.
std::string HistoryFile() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return absl::StrCat(state, "/hullctl/history");
  const char* const home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') return "";
  return absl::StrCat(home, "/.local/state/hullctl/history");
}

ExitCode Shell(Invocation* run) {
  LineEditor editor("hullctl", "hullctl> ", HistoryFile(), [run](const std::string& line) {
    std::vector<std::string> texts;
    for (const Candidate& candidate :
         Complete(*run->program, SplitUnfinished(line), ValuesFor(run)).candidates) {
      texts.push_back(candidate.text);
    }
    return texts;
  });
  if (editor.is_terminal()) {
    run->out << "Commands of hullctl without its name, such as 'list'; 'help' lists them, 'exit' "
                "ends.\n"
             << std::flush;
  }
  ExitCode last = ExitCode::kDone;
  for (std::optional<std::string> line; (line = editor.Next()).has_value();) {
    absl::StatusOr<std::vector<std::string>> words = SplitWords(*line);
    if (!words.ok()) {
      last = run->FailUsage(words.status());
      continue;
    }
    if (!words->empty() && words->front() == "hullctl") words->erase(words->begin());
    if (words->empty()) continue;
    editor.Remember(*line);
    if (words->front() == "exit" || words->front() == "quit") break;
    if (words->front() == "shell") {
      last = run->FailUsage(absl::InvalidArgumentError("this is a shell already"));
      continue;
    }
    last = static_cast<ExitCode>(run->run_line(*words));
    run->out << std::flush;
  }
  return last;
}

}  // namespace

void AddShellCommand(Command program, Invocation* invocation) {
  Command command = program.AddCommand("shell", "Type commands one after another");
  command.SetDetails(
      "Lines are commands of hullctl without its name. Tab completes, arrows and Ctrl-R bring\n"
      "earlier lines back, Ctrl-C gives a line up, Ctrl-D ends. Options such as --server and\n"
      "--output hold for all lines; a line that names another server has none of those that say\n"
      "where the server is. Lines may also come from a file; the exit code is that of the last.");
  command.SetExamples({{"", "hullctl shell --server hulls.example:50551 --tls"},
                       {"", "hullctl shell < commands.txt"}});
  command.OnGiven([=] { invocation->action = [=] { return Shell(invocation); }; });
}

}  // namespace hulld
