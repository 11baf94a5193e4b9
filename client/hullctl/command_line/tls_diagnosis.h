#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_TLS_DIAGNOSIS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_TLS_DIAGNOSIS_H_

#include <string>

#include "client/connection_security.h"

namespace hulld {

// Why a connection to `server` (host:port) with this security fails, where TLS is the reason, and
// what to try; empty when it is not. gRPC tells certificates that have expired from those of
// strangers no more than servers that speak no TLS from dead ones, so this shakes hands with the
// server once more by itself. Takes a few seconds at most.
std::string DiagnoseTls(const std::string& server, const ConnectionSecurity& security);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_TLS_DIAGNOSIS_H_
