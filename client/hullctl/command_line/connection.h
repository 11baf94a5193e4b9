#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_H_

#include <absl/status/status.h>

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares --server, --context and what goes with them; they fill invocation->flags and
// invocation->context.
void AddConnectionOptions(Command command, Invocation* invocation);

// After parsing: chooses each setting from options, environment, context and default, in this
// order, and reads the files that they name. A context that is named by --context stands before the
// environment. INVALID_ARGUMENT: a file cannot be read, or settings do not go together.
absl::Status ResolveConnection(Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_H_
