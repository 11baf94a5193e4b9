#ifndef HULLD_CLIENT_HULLCTL_BODY_BODY_COMMAND_H_
#define HULLD_CLIENT_HULLCTL_BODY_BODY_COMMAND_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares `body` and its commands, as in commands.h.
void AddBodyCommand(Command program, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_BODY_BODY_COMMAND_H_
