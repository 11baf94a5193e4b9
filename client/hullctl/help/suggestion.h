#ifndef HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_
#define HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_

#include <string>
#include <vector>

namespace hulld {

// `; did you mean "check"?` for a word that is none of `known`, or nothing when none is near. Near
// is one that starts with it, or the nearest one within a third of its letters (Levenshtein's
// distance, exchanged neighbours counted once). Case does not count.
std::string Suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_SUGGESTION_H_
