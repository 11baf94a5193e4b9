#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_DELETION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_DELETION_H_

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Whether a person at the terminal says that these are to be deleted; the question tells how many
// there are and which come first. `one`, `many`: what they are, as in "hull" and "hulls".
// INVALID_ARGUMENT, advising --yes: there is no terminal.
absl::StatusOr<bool> ConfirmDeletion(const Invocation& run, const std::vector<std::string>& ids,
                                     const std::string& one, const std::string& many);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_DELETION_H_
