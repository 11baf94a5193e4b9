#ifndef HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_SCRIPT_H_
#define HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_SCRIPT_H_

#include <string>

namespace hulld {

// Hidden first argument that requests completions. The remaining arguments are the words after the
// program's name up to the cursor. Each line of the answer is a candidate, a tab, and its help; the
// last line is ":", then "files", "directories", or nothing: the shell's own completion to add.
inline constexpr char kCompleteCommand[] = "__complete";

// Returns the script that makes bash, zsh, or fish complete hullctl's command lines. `shell` is one
// of these three names.
std::string CompletionScript(const std::string& shell);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_SCRIPT_H_
