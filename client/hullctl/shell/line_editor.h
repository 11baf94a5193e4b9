#ifndef HULLD_CLIENT_HULLCTL_SHELL_LINE_EDITOR_H_
#define HULLD_CLIENT_HULLCTL_SHELL_LINE_EDITOR_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hulld {

// Reads lines from standard input. On a terminal, libedit provides editing, history, and
// completion; otherwise lines are read plainly, without a prompt.
class LineEditor {
 public:
  // Returns the completions of the last word of a line.
  using Completer = std::function<std::vector<std::string>(const std::string& line)>;

  // history_file: keeps lines between sessions; empty: none.
  LineEditor(const std::string& program, const std::string& prompt, const std::string& history_file,
             Completer complete);
  ~LineEditor();
  LineEditor(const LineEditor&) = delete;
  LineEditor& operator=(const LineEditor&) = delete;

  // Returns the next line without its end; nullopt at the end of the input.
  std::optional<std::string> Next();
  // Adds a line to the history.
  void Remember(const std::string& line);

  // Returns true if the input is interactive.
  bool is_terminal() const;

 private:
  class Terminal;
  // Null if the input is not interactive.
  std::unique_ptr<Terminal> terminal_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SHELL_LINE_EDITOR_H_
