#ifndef HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_COMMANDS_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_COMMANDS_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares `robot` and its subcommands. `invocation` must outlive the action.
void AddRobotCommand(Command program, Invocation* invocation);

// Declare the subcommands.
void AddRobotCheckCommand(Command robot, Invocation* invocation);
void AddRobotAcmCommand(Command robot, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_COMMANDS_H_
