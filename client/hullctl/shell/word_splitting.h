#ifndef HULLD_CLIENT_HULLCTL_SHELL_WORD_SPLITTING_H_
#define HULLD_CLIENT_HULLCTL_SHELL_WORD_SPLITTING_H_

#include <absl/status/statusor.h>

#include <string>
#include <vector>

namespace hulld {

// Splits a line into words like a POSIX shell: at blanks; 'quotes', "quotes", and backslashes keep
// characters together; a # at the start of a word begins a comment. Expands nothing: no variables,
// no patterns. INVALID_ARGUMENT: an unterminated quote, or syntax that needs a shell, such as a
// pipe.
absl::StatusOr<std::vector<std::string>> SplitWords(const std::string& line);

// Splits as far as possible, for completion: the last word is the one at the end of the line, empty
// after a blank.
std::vector<std::string> SplitUnfinished(const std::string& line);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SHELL_WORD_SPLITTING_H_
