#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_COMMANDS_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_COMMANDS_H_

#include <absl/status/status.h>

#include <string>

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares `scene apply`, `scene diff`, and `scene delete` below `scene`. `scene_file`: the FILE of
// `scene` itself, which must be empty for these commands. Both must outlive the action.
void AddSceneSyncCommands(Command scene, const std::string* scene_file, Invocation* invocation);

// INVALID_ARGUMENT unless it is empty.
absl::Status RefuseSecondFile(const std::string& scene_file);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_COMMANDS_H_
