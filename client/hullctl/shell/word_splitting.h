#ifndef HULLD_CLIENT_HULLCTL_SHELL_WORD_SPLITTING_H_
#define HULLD_CLIENT_HULLCTL_SHELL_WORD_SPLITTING_H_

#include <absl/status/statusor.h>

#include <string>
#include <vector>

namespace hulld {

// A line's words as a POSIX shell cuts them: at blanks; 'quotes', "quotes" and backslashes keep
// characters together; a # at the start of a word begins a comment. Nothing is replaced: no
// variables, no patterns. INVALID_ARGUMENT: a quote does not end, or the line holds what only a
// shell can do, such as a pipe.
absl::StatusOr<std::vector<std::string>> SplitWords(const std::string& line);

// The same as far as it goes, for completion: the last word is the one at the line's end, empty
// behind a blank.
std::vector<std::string> SplitUnfinished(const std::string& line);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SHELL_WORD_SPLITTING_H_
