#ifndef HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_
#define HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_

#include <string>
#include <vector>

namespace hulld {

// Returns `; did you mean "check"?` for a word not in `known`, or nothing if no word is close. A
// close word starts with it, or is the nearest word within a third of its letters (Levenshtein
// distance, a swap of adjacent letters counts as one). Case does not count.
std::string Suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_
