#ifndef HULLD_CLIENT_HULLCTL_SHELL_LINE_EDITOR_H_
#define HULLD_CLIENT_HULLCTL_SHELL_LINE_EDITOR_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hulld {

// Reads lines from standard input. On a terminal they are edited, remembered and completed, by
// libedit; otherwise they are taken as they come, without a prompt.
class LineEditor {
 public:
  // What can stand for the last word of a line.
  using Completer = std::function<std::vector<std::string>(const std::string& line)>;

  // history_file: where lines are kept between sessions; empty: nowhere.
  LineEditor(const std::string& program, const std::string& prompt, const std::string& history_file,
             Completer complete);
  ~LineEditor();
  LineEditor(const LineEditor&) = delete;
  LineEditor& operator=(const LineEditor&) = delete;

  // The next line without its end; nullopt at the end of the input.
  std::optional<std::string> Next();
  // Keeps a line.
  void Remember(const std::string& line);

  // Somebody types.
  bool is_terminal() const;

 private:
  class Terminal;
  // Null when nobody types.
  std::unique_ptr<Terminal> terminal_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SHELL_LINE_EDITOR_H_
