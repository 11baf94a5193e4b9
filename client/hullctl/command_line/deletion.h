#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_DELETION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_DELETION_H_

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Returns true if the user at the terminal confirms the deletion. The prompt states the number of
// items and the first ones. `one`, `many`: nouns such as "hull" and "hulls". INVALID_ARGUMENT,
// advising --yes: no terminal.
absl::StatusOr<bool> ConfirmDeletion(const Invocation& run, const std::vector<std::string>& ids,
                                     const std::string& one, const std::string& many);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_DELETION_H_
