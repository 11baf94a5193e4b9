#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_TLS_DIAGNOSIS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_TLS_DIAGNOSIS_H_

#include <string>

#include "client/connection_security.h"

namespace hulld {

// Explains why a connection to `server` (host:port) with this security fails, with a remedy; empty
// if TLS is not the cause. gRPC does not distinguish an expired certificate from an unknown
// authority, or a server without TLS from a dead one, so this performs its own handshake. Takes a
// few seconds at most.
std::string DiagnoseTls(const std::string& server, const ConnectionSecurity& security);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_TLS_DIAGNOSIS_H_
