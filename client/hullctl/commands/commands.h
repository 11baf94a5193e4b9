#ifndef HULLD_CLIENT_HULLCTL_COMMANDS_COMMANDS_H_
#define HULLD_CLIENT_HULLCTL_COMMANDS_COMMANDS_H_

#include <CLI/App.hpp>

#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Each declares one command; when it is the one named, parsing sets invocation->action. Both
// arguments must outlive the action.
void AddCreateCommand(CLI::App* app, Invocation* invocation);
void AddAppendCommand(CLI::App* app, Invocation* invocation);
void AddReplaceCommand(CLI::App* app, Invocation* invocation);
void AddGetCommand(CLI::App* app, Invocation* invocation);
void AddListCommand(CLI::App* app, Invocation* invocation);
void AddDeleteCommand(CLI::App* app, Invocation* invocation);
void AddMeshCommand(CLI::App* app, Invocation* invocation);
void AddCheckCommand(CLI::App* app, Invocation* invocation);
void AddBatchCommand(CLI::App* app, Invocation* invocation);
void AddSceneCommand(CLI::App* app, Invocation* invocation);
void AddStreamCommand(CLI::App* app, Invocation* invocation);
void AddVerifyCommand(CLI::App* app, Invocation* invocation);
void AddGenerateCommand(CLI::App* app, Invocation* invocation);
void AddStatusCommand(CLI::App* app, Invocation* invocation);
void AddBackupCommand(CLI::App* app, Invocation* invocation);
void AddBenchCommand(CLI::App* app, Invocation* invocation);
void AddPictureCommand(CLI::App* app, Invocation* invocation);
void AddTokenCommand(CLI::App* app, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMANDS_COMMANDS_H_
