#include <absl/strings/match.h>
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

// $XDG_STATE_HOME/hullctl/history, or the same under ~/.local/state.
std::string HistoryFile() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return absl::StrCat(state, "/hullctl/history");
  const char* const home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') return "";
  return absl::StrCat(home, "/.local/state/hullctl/history");
}

// The options that this shell was started with, for each of its lines.
std::vector<std::string> SharedOptions(const Invocation& run) {
  std::vector<std::string> options;
  for (const ConnectionSetting& setting : kConnectionSettings) {
    const auto found = run.flags.find(setting.name);
    if (found == run.flags.end()) continue;
    options.push_back(absl::StrCat("--", setting.name));
    if (setting.kind != SettingKind::kFlag) options.push_back(found->second);
  }
  if (!run.context.empty()) options.insert(options.end(), {"--context", run.context});
  if (run.given_timeout) {
    options.insert(options.end(), {"--timeout", absl::StrCat(run.given_timeout->count(), "ms")});
  }
  return options;
}

// A line's own options come behind the shared ones, of which it may name another value.
std::vector<std::string> WithShared(const std::vector<std::string>& words,
                                    const std::vector<std::string>& shared) {
  std::vector<std::string> arguments = words;
  for (size_t i = 0; i < shared.size(); ++i) {
    const bool takes_value = i + 1 < shared.size() && !absl::StartsWith(shared[i + 1], "--");
    const bool named = std::any_of(words.begin(), words.end(), [&](const std::string& word) {
      const std::string name = word == "-s" ? "--server" : word.substr(0, word.find('='));
      // Each of the two says which server is meant.
      const bool is_server = name == "--server" || name == "--context";
      const bool was_server = shared[i] == "--server" || shared[i] == "--context";
      return name == shared[i] || (is_server && was_server);
    });
    if (!named) {
      arguments.push_back(shared[i]);
      if (takes_value) arguments.push_back(shared[i + 1]);
    }
    if (takes_value) ++i;
  }
  return arguments;
}

ExitCode Shell(Invocation* run) {
  const std::vector<std::string> shared = SharedOptions(*run);
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
    last = static_cast<ExitCode>(run->run_line(WithShared(*words, shared)));
    run->out << std::flush;
  }
  return last;
}

}  // namespace

void AddShellCommand(Command program, Invocation* invocation) {
  Command command = program.AddCommand("shell", "Type commands one after another");
  command.SetDetails(
      "Lines are commands of hullctl without its name. Tab completes, arrows and Ctrl-R bring\n"
      "earlier lines back, Ctrl-D ends. Options such as --server hold for all lines. Lines may\n"
      "also come from a file; the exit code is that of the last one.");
  command.SetExamples({{"", "hullctl shell --server hulls.example:50551 --tls"},
                       {"", "hullctl shell < commands.txt"}});
  command.OnGiven([=] { invocation->action = [=] { return Shell(invocation); }; });
}

}  // namespace hulld
