#ifndef HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_H_
#define HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_H_

#include <functional>
#include <string>
#include <vector>

#include "client/hullctl/help/command_description.h"

namespace hulld {

struct Invocation;

// A possible word at the cursor.
struct Candidate {
  std::string text;
  std::string help;
};

struct Completion {
  std::vector<Candidate> candidates;
  // Adds the shell's own completion of files, or of directories.
  bool files = false;
  bool directories = false;
};

// Returns the values of a kind that start with a text, such as the IDs of hulls.
using ValueSource = std::function<std::vector<Candidate>(ValueKind kind, const std::string& start)>;

// Returns the completions of the last of `words`: the words after the program's name up to the
// cursor. The last one may be empty. `values` is called only for values unknown to the parser.
Completion Complete(const CommandDescription& program, const std::vector<std::string>& words,
                    const ValueSource& values);

// Returns names of contexts from the file, and IDs of hulls from the server that the invocation's
// options name. Returns nothing if the server does not answer within half a second, or refuses.
// Many IDs are abbreviated to their text before the next "/". `invocation` must outlive the result.
ValueSource ValuesFor(Invocation* invocation);

// Returns the program's own options among the words, with their values, except for the last word.
// They determine the server to query.
std::vector<std::string> ProgramOptionsIn(const CommandDescription& program,
                                          const std::vector<std::string>& words);

// Hidden first argument that requests completions. The remaining arguments are the words after the
// program's name up to the cursor. Each line of the answer is a candidate, a tab, and its help; the
// last line is ":", then "files", "directories", or nothing: the shell's own completion to add.
inline constexpr char kCompleteCommand[] = "__complete";

// Returns the script that makes bash, zsh, or fish complete hullctl's command lines. `shell` is one
// of these three names.
std::string CompletionScript(const std::string& shell);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_H_
