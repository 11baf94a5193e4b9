#ifndef HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_VALUES_H_
#define HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_VALUES_H_

#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/completion/completion.h"

namespace hulld {

// Returns names of contexts from the file, and IDs of hulls from the server that the invocation's
// options name. Returns nothing if the server does not answer within half a second, or refuses.
// Many IDs are abbreviated to their text before the next "/". `invocation` must outlive the result.
ValueSource ValuesFor(Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_VALUES_H_
