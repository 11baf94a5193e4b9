#ifndef HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_
#define HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_

#include <string>
#include <vector>

namespace hulld {

// Returns `; did you mean "check"?` for a word not in `known`, or nothing if no word is close. A
// word is close if it starts with the given word, or if it is the nearest known word and differs in
// at most a third of the letters (Levenshtein distance, with a swap of adjacent letters as one
// edit). Case is ignored.
std::string Suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_
