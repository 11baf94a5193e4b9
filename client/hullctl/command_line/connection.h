#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_H_

#include <absl/status/status.h>

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares --server, --context, and the related options; they set invocation->flags and
// invocation->context.
void AddConnectionOptions(Command command, Invocation* invocation);

// Resolves the connection after parsing: takes each setting from options, environment, context, or
// default, in this order, and reads the files they name. A context from --context precedes the
// environment. INVALID_ARGUMENT: a file cannot be read, or settings conflict.
absl::Status ResolveConnection(Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_CONNECTION_H_
