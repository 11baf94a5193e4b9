#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_UNKNOWN_COMMAND_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_UNKNOWN_COMMAND_H_

#include <string>
#include <vector>

namespace hulld {

// What to say of a word that stands where a command must: that it is unknown, and which of
// `commands` it may have meant. That is one that starts with it, or the nearest one within a third
// of its letters (Levenshtein's distance, exchanged neighbours counted once).
std::string ExplainUnknownCommand(const std::string& word,
                                  const std::vector<std::string>& commands);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_UNKNOWN_COMMAND_H_
