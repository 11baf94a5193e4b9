#ifndef HULLD_CLIENT_HULLCTL_PAIRS_JUDGE_COMMAND_H_
#define HULLD_CLIENT_HULLCTL_PAIRS_JUDGE_COMMAND_H_

#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Declares `judge`. `invocation` must outlive the action.
void AddJudgeCommand(Command program, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PAIRS_JUDGE_COMMAND_H_
