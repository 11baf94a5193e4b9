#ifndef HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_H_
#define HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_H_

#include <functional>
#include <string>
#include <vector>

#include "client/hullctl/help/command_description.h"

namespace hulld {

// A word that can stand where the cursor is.
struct Candidate {
  std::string text;
  std::string help;
};

struct Completion {
  std::vector<Candidate> candidates;
  // The shell's own completion of files, or of directories, applies too.
  bool files = false;
  bool directories = false;
};

// The values of a kind that start with a text, such as the IDs of hulls.
using ValueSource = std::function<std::vector<Candidate>(ValueKind kind, const std::string& start)>;

// What can stand for the last of `words`, which are those behind the program's name up to the
// cursor; the last one may be empty. `values` is asked only for what cannot be known otherwise.
Completion Complete(const CommandDescription& program, const std::vector<std::string>& words,
                    const ValueSource& values);

// The options of the program itself among the words, with their values, but for the last word: they
// tell which server to ask.
std::vector<std::string> ProgramOptionsIn(const CommandDescription& program,
                                          const std::vector<std::string>& words);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_H_
