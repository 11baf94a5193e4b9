#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_COMMANDS_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_COMMANDS_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares `scene apply`, `scene diff`, and `scene delete` below `scene`. `invocation` must outlive
// the action.
void AddSceneSyncCommands(Command scene, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_COMMANDS_H_
