#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_OPTIONS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_OPTIONS_H_

#include <absl/status/status.h>

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares --tls and what goes with it, and --token-file; they fill invocation->security.
void AddConnectionOptions(Command command, Invocation* invocation);

// After parsing: takes the token of the environment when no file gives one. INVALID_ARGUMENT: the
// options do not go together.
absl::Status CompleteConnectionOptions(Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_OPTIONS_H_
