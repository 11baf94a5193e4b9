#ifndef HULLD_CLIENT_SERVER_ADDRESS_H_
#define HULLD_CLIENT_SERVER_ADDRESS_H_

#include <absl/status/status.h>

#include <string>

// Target names of servers:
//
//   HOST:PORT                     one server
//   ADDRESS:PORT,ADDRESS:PORT     several over one store: IP addresses, all v4 or all v6
//   dns:///NAME:PORT              all addresses of a DNS name
//   unix:PATH                     one on this machine
//
// and any other gRPC target name.
namespace hulld {

// INVALID_ARGUMENT: the name has none of these forms; the message lists the valid ones.
absl::Status ValidateServer(const std::string& server);

// Returns true if calls are spread round robin over several servers (a list, or dns:///), limited
// to the reachable ones that report SERVING.
bool NamesSeveral(const std::string& server);

// Returns the gRPC target name.
std::string TargetName(const std::string& server);

// Returns true if every named server is on this machine. False if that depends on DNS.
bool IsLoopback(const std::string& server);

}  // namespace hulld

#endif  // HULLD_CLIENT_SERVER_ADDRESS_H_
