#ifndef HULLD_CLIENT_HULLCTL_COMMANDS_COMMANDS_H_
#define HULLD_CLIENT_HULLCTL_COMMANDS_COMMANDS_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/command_line/query_options.h"
#include "client/hullctl/scene/scene_file.h"

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

// Queries the pairs of a scene read from `file`, as 'hullctl batch' does.
ExitCode AnswerPairs(const Invocation& run, const std::string& file, const Scene& scene,
                     const QueryDetails& details, bool colliding);
// Returns the form of bodies in queries. Certificates and the textbook's test apply to hulls only.
BodyForm FormFor(const QueryDetails& details);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMANDS_COMMANDS_H_
