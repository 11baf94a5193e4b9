#include "client/hullctl/shell/line_editor.h"

#include <fcntl.h>
#include <histedit.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <utility>

namespace hulld {

class LineEditor::Terminal {
 public:
  Terminal(const std::string& program, std::string prompt, std::string history_file,
           Completer complete)
      : prompt_(std::move(prompt)),
        history_file_(std::move(history_file)),
        complete_(std::move(complete)),
        history_(history_init()),
        edit_(el_init(program.c_str(), stdin, stdout, stderr)) {
    el_set(edit_, EL_CLIENTDATA, this);
    el_set(edit_, EL_PROMPT, &Terminal::Prompt);
    el_set(edit_, EL_EDITOR, "emacs");
    el_set(edit_, EL_SIGNAL, 1);
    el_set(edit_, EL_HIST, history, history_);
    el_set(edit_, EL_ADDFN, "complete", "Complete the word", &Terminal::CompleteWord);
    el_set(edit_, EL_BIND, "^I", "complete", nullptr);
    el_set(edit_, EL_BIND, "^R", "em-inc-search-prev", nullptr);
    el_source(edit_, nullptr);
    HistEvent event;
    history(history_, &event, H_SETSIZE, kKept);
    history(history_, &event, H_SETUNIQUE, 1);
    if (!history_file_.empty()) history(history_, &event, H_LOAD, history_file_.c_str());
  }

  ~Terminal() {
    el_end(edit_);
    history_end(history_);
  }

  std::optional<std::string> Next() {
    int length = 0;
    interrupted_ = 0;
    struct sigaction note = {};
    note.sa_handler = [](int) { interrupted_ = 1; };
    struct sigaction before = {};
    sigaction(SIGINT, &note, &before);
    const char* const line = el_gets(edit_, &length);
    sigaction(SIGINT, &before, nullptr);
    if (interrupted_ != 0) {
      // Ctrl-C discards the line and keeps the shell.
      el_reset(edit_);
      std::cout << "^C\n" << std::flush;
      return "";
    }
    if (line == nullptr || length <= 0) return std::nullopt;
    std::string text(line, static_cast<size_t>(length));
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    return text;
  }

  void Remember(const std::string& line) {
    HistEvent event;
    history(history_, &event, H_ENTER, line.c_str());
    if (history_file_.empty()) return;
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path(history_file_).parent_path(),
                                        ignored);
    // Created readable by its owner only.
    close(open(history_file_.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
    history(history_, &event, H_SAVE, history_file_.c_str());
  }

 private:
  static constexpr int kKept = 1000;
  static volatile std::sig_atomic_t interrupted_;

  static Terminal* Of(EditLine* edit) {
    void* self = nullptr;
    el_get(edit, EL_CLIENTDATA, &self);
    return static_cast<Terminal*>(self);
  }

  static char* Prompt(EditLine* edit) { return Of(edit)->prompt_.data(); }

  static unsigned char CompleteWord(EditLine* edit, int) {
    const LineInfo* const info = el_line(edit);
    return Of(edit)->Complete({info->buffer, info->cursor});
  }

  unsigned char Complete(const std::string& line) {
    const std::vector<std::string> candidates = complete_(line);
    if (candidates.empty()) return CC_REFRESH_BEEP;
    const size_t start = line.find_last_of(" \t") + 1;
    const std::string word = line.substr(start);
    std::string common = candidates.front();
    for (const std::string& candidate : candidates) {
      const auto ends =
          std::mismatch(common.begin(), common.end(), candidate.begin(), candidate.end());
      common.erase(ends.first, common.end());
    }
    if (candidates.size() == 1 && common.back() != '/') common += " ";
    if (common.size() > word.size()) {
      el_insertstr(edit_, common.substr(word.size()).c_str());
      return CC_REFRESH;
    }
    std::cout << "\n";
    for (const std::string& candidate : candidates) std::cout << candidate << "\n";
    std::cout << std::flush;
    return CC_REDISPLAY;
  }

  std::string prompt_;
  const std::string history_file_;
  const Completer complete_;
  History* const history_;
  EditLine* const edit_;
};

volatile std::sig_atomic_t LineEditor::Terminal::interrupted_ = 0;

LineEditor::LineEditor(const std::string& program, const std::string& prompt,
                       const std::string& history_file, Completer complete) {
  if (isatty(STDIN_FILENO) == 0 || isatty(STDOUT_FILENO) == 0) return;
  terminal_ = std::make_unique<Terminal>(program, prompt, history_file, std::move(complete));
}

LineEditor::~LineEditor() = default;

bool LineEditor::is_terminal() const { return terminal_ != nullptr; }

std::optional<std::string> LineEditor::Next() {
  if (terminal_ != nullptr) return terminal_->Next();
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  return line;
}

void LineEditor::Remember(const std::string& line) {
  if (terminal_ != nullptr) terminal_->Remember(line);
}

}  // namespace hulld
