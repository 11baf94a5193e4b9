#ifndef HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_VALUES_H_
#define HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_VALUES_H_

#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/completion/completion.h"

namespace hulld {

// Names of contexts from the file, and IDs of hulls from the server that the invocation's options
// name. Nothing comes where the server does not answer within half a second, or refuses. When there
// are very many IDs, only what stands before their next "/" comes. `invocation` must outlive the
// result.
ValueSource ValuesFor(Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMPLETION_COMPLETION_VALUES_H_
