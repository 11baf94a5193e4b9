#ifndef HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_SCRIPT_H_
#define HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_SCRIPT_H_

#include <string>

namespace hulld {

// The hidden first argument that asks for candidates: the words behind it are those behind the
// program's name up to the cursor. Each line of the answer is a candidate, a tab and its help; the
// last line is ":", then "files", "directories" or nothing: what the shell is to add.
inline constexpr char kCompleteCommand[] = "__complete";

// What bash, zsh or fish is to read so that it completes hullctl's command lines. `shell` is one of
// these three.
std::string CompletionScript(const std::string& shell);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_SCRIPT_H_
