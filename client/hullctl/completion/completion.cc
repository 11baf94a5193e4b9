#include "client/hullctl/completion/completion.h"

#include <absl/strings/match.h>

#include <algorithm>
#include <utility>

namespace hulld {
namespace {

// Interprets words as the parser does: the named command, its arguments, and the option left open
// at the end.
class WordReader {
 public:
  explicit WordReader(const CommandDescription& program) : path_{&program} {}

  void Take(const std::string& word) {
    if (open_ != nullptr) {
      open_ = nullptr;
    } else if (!only_arguments_ && word == "--") {
      only_arguments_ = true;
    } else if (!only_arguments_ && word.size() > 1 && word[0] == '-') {
      const OptionDescription* const option = Find(word.substr(0, word.find('=')));
      if (option != nullptr) given_.push_back(option);
      const bool has_value = word.find('=') != std::string::npos;
      if (option != nullptr && option->takes_value() && !has_value) open_ = option;
    } else if (const CommandDescription* below = FindCommand(*path_.back(), {word});
               below != nullptr) {
      path_.push_back(below);
    } else {
      ++arguments_;
    }
  }

  // Returns the option with that name, of the command or of an ancestor; null if none has it.
  const OptionDescription* Find(const std::string& name) const {
    for (auto command = path_.rbegin(); command != path_.rend(); ++command) {
      const OptionDescription* const option = FindOption(**command, name);
      if (option != nullptr) return option;
    }
    return nullptr;
  }

  // Returns the argument that the next word fills; null if no further one fits.
  const OptionDescription* NextArgument() const {
    size_t left = arguments_;
    for (const OptionDescription& option : command().options) {
      if (!option.is_argument()) continue;
      if (option.repeated || left == 0) return &option;
      --left;
    }
    return nullptr;
  }

  const CommandDescription& command() const { return *path_.back(); }
  const std::vector<const CommandDescription*>& path() const { return path_; }
  // Returns the option that takes the next word as its value; null if none.
  const OptionDescription* open() const { return open_; }
  bool only_arguments() const { return only_arguments_; }
  bool was_given(const OptionDescription& option) const {
    return std::find(given_.begin(), given_.end(), &option) != given_.end();
  }

 private:
  std::vector<const CommandDescription*> path_;
  const OptionDescription* open_ = nullptr;
  std::vector<const OptionDescription*> given_;
  size_t arguments_ = 0;
  bool only_arguments_ = false;
};

void Offer(const std::string& text, const std::string& help, const std::string& start,
           Completion* completion) {
  if (absl::StartsWith(text, start)) completion->candidates.push_back({text, help});
}

// Offers the values of an option or argument, each prefixed with `front`.
void OfferValues(const OptionDescription& option, const std::string& start,
                 const std::string& front, const ValueSource& values, Completion* completion) {
  for (const std::string& choice : option.choices) {
    if (absl::StartsWith(choice, start)) completion->candidates.push_back({front + choice, ""});
  }
  if (!option.choices.empty()) return;
  const ValueKind kind = option.value_kind;
  if (kind == ValueKind::kText) return;
  completion->files = kind == ValueKind::kFile || kind == ValueKind::kShape;
  completion->directories = kind == ValueKind::kDirectory;
  if (kind == ValueKind::kFile || kind == ValueKind::kDirectory) return;
  for (Candidate& value : values(kind, start)) {
    value.text = front + value.text;
    completion->candidates.push_back(std::move(value));
  }
}

void OfferOptions(const WordReader& reader, const std::string& start, Completion* completion) {
  for (auto command = reader.path().rbegin(); command != reader.path().rend(); ++command) {
    for (const OptionDescription& option : (*command)->options) {
      if (option.is_argument() || option.hidden || reader.was_given(option)) continue;
      // --version belongs to the program, not to its commands.
      if (option.long_name() == "--version" && reader.path().size() > 1) continue;
      Offer(option.long_name(), option.help, start, completion);
    }
  }
}

}  // namespace

Completion Complete(const CommandDescription& program, const std::vector<std::string>& words,
                    const ValueSource& values) {
  Completion completion;
  if (words.empty()) return completion;
  WordReader reader(program);
  for (size_t i = 0; i + 1 < words.size(); ++i) reader.Take(words[i]);
  const std::string& word = words.back();
  if (reader.open() != nullptr) {
    OfferValues(*reader.open(), word, "", values, &completion);
    return completion;
  }
  if (!reader.only_arguments() && absl::StartsWith(word, "-")) {
    const size_t equals = word.find('=');
    if (equals == std::string::npos) {
      OfferOptions(reader, word, &completion);
      return completion;
    }
    const OptionDescription* const option = reader.Find(word.substr(0, equals));
    if (option == nullptr || !option->takes_value()) return completion;
    OfferValues(*option, word.substr(equals + 1), word.substr(0, equals + 1), values, &completion);
    return completion;
  }
  for (const auto& below : reader.command().commands) {
    if (!below->hidden) Offer(below->name, below->help, word, &completion);
  }
  if (const OptionDescription* const argument = reader.NextArgument(); argument != nullptr) {
    OfferValues(*argument, word, "", values, &completion);
  }
  return completion;
}

std::vector<std::string> ProgramOptionsIn(const CommandDescription& program,
                                          const std::vector<std::string>& words) {
  std::vector<std::string> found;
  for (size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--") break;
    const size_t equals = word.find('=');
    const OptionDescription* const option = FindOption(program, word.substr(0, equals));
    if (option == nullptr || option->is_argument()) continue;
    // Skips the options that would end the program.
    if (option->long_name() == "--help" || option->long_name() == "--version") continue;
    const bool takes_next = option->takes_value() && equals == std::string::npos;
    if (takes_next && i + 2 >= words.size()) break;
    found.push_back(word);
    if (takes_next) found.push_back(words[++i]);
  }
  return found;
}

}  // namespace hulld
