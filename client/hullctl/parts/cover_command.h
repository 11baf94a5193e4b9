#ifndef HULLD_CLIENT_HULLCTL_PARTS_COVER_COMMAND_H_
#define HULLD_CLIENT_HULLCTL_PARTS_COVER_COMMAND_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares `cover`. `invocation` must outlive the action.
void AddCoverCommand(Command program, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PARTS_COVER_COMMAND_H_
