#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_COMMANDS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_COMMANDS_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Each declares a command of `program`. If the command is given, parsing sets invocation->action.
// `invocation` must outlive the action.
void AddCreateCommand(Command program, Invocation* invocation);
void AddAppendCommand(Command program, Invocation* invocation);
void AddReplaceCommand(Command program, Invocation* invocation);
void AddDeleteCommand(Command program, Invocation* invocation);
void AddListCommand(Command program, Invocation* invocation);
void AddGetCommand(Command program, Invocation* invocation);
void AddMeshCommand(Command program, Invocation* invocation);
void AddViewCommand(Command program, Invocation* invocation);
void AddCheckCommand(Command program, Invocation* invocation);
void AddCastCommand(Command program, Invocation* invocation);
void AddBatchCommand(Command program, Invocation* invocation);
void AddBodyCommand(Command program, Invocation* invocation);
void AddCoverCommand(Command program, Invocation* invocation);
void AddJudgeCommand(Command program, Invocation* invocation);
void AddRobotCommand(Command program, Invocation* invocation);
void AddSceneCommand(Command program, Invocation* invocation);
void AddStreamCommand(Command program, Invocation* invocation);
void AddVerifyCommand(Command program, Invocation* invocation);
void AddWatchCommand(Command program, Invocation* invocation);
void AddStatusCommand(Command program, Invocation* invocation);
void AddHealthCommand(Command program, Invocation* invocation);
void AddBackupCommand(Command program, Invocation* invocation);
void AddTokenCommand(Command program, Invocation* invocation);
void AddBenchCommand(Command program, Invocation* invocation);
void AddContextCommand(Command program, Invocation* invocation);
void AddCompletionCommand(Command program, Invocation* invocation);
void AddGenerateCommand(Command program, Invocation* invocation);
// Hidden: writes man pages, for the build.
void AddManCommand(Command program, Invocation* invocation);

// Likewise, declare commands of `robot`, and `scene apply`, `scene diff`, and `scene delete`.
void AddRobotCheckCommand(Command robot, Invocation* invocation);
void AddRobotAcmCommand(Command robot, Invocation* invocation);
void AddSceneSyncCommands(Command scene, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_COMMANDS_H_
