#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_FRESHNESS_OPTIONS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_FRESHNESS_OPTIONS_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares --max-staleness and --at-least for a read command. They set invocation->freshness, which
// applies to all reads of the command.
void AddFreshnessOptions(Command command, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_FRESHNESS_OPTIONS_H_
