#include "client/hullctl/shell/word_splitting.h"

#include <absl/strings/str_cat.h>

namespace hulld {
namespace {

struct Split {
  std::vector<std::string> words;
  // True if the last word is still open at the end of the line.
  bool open_word = false;
  // The unterminated quote; 0: none.
  char open_quote = 0;
  // A character outside of quotes that is special to a shell; 0: none.
  char special = 0;
};

Split SplitLine(const std::string& line) {
  Split split;
  bool in_word = false;
  char quote = 0;
  const auto word = [&]() -> std::string& {
    if (!in_word) split.words.emplace_back();
    in_word = true;
    return split.words.back();
  };
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    const bool escapes = c == '\\' && quote != '\'' && i + 1 < line.size();
    if (escapes) {
      word() += line[++i];
    } else if (quote != 0) {
      if (c == quote) {
        quote = 0;
      } else {
        word() += c;
      }
    } else if (c == '"' || c == '\'') {
      quote = c;
      word();
    } else if (c == ' ' || c == '\t') {
      in_word = false;
    } else if (c == '#' && !in_word) {
      break;
    } else {
      if (split.special == 0 && std::string("|<>;&").find(c) != std::string::npos) {
        split.special = c;
      }
      word() += c;
    }
  }
  split.open_word = in_word;
  split.open_quote = quote;
  return split;
}

}  // namespace

absl::StatusOr<std::vector<std::string>> SplitWords(const std::string& line) {
  Split split = SplitLine(line);
  if (split.open_quote != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("the quote ", std::string(1, split.open_quote), " does not end"));
  }
  if (split.special != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", std::string(1, split.special),
                     "\" is for a shell of the system; put it in quotes if it belongs to a name"));
  }
  return std::move(split.words);
}

std::vector<std::string> SplitUnfinished(const std::string& line) {
  Split split = SplitLine(line);
  if (!split.open_word) split.words.emplace_back();
  return std::move(split.words);
}

}  // namespace hulld
