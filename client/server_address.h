#ifndef HULLD_CLIENT_SERVER_ADDRESS_H_
#define HULLD_CLIENT_SERVER_ADDRESS_H_

#include <absl/status/status.h>

#include <string>

// How a client is told where its servers are:
//
//   HOST:PORT                     one server
//   ADDRESS:PORT,ADDRESS:PORT     several over one store: IP addresses, all v4 or all v6
//   dns:///NAME:PORT              all that a DNS name stands for
//   unix:PATH                     one on this machine
//
// and any other target name of gRPC.
namespace hulld {

// INVALID_ARGUMENT: it is none of these; the message tells what to write.
absl::Status ValidateServer(const std::string& server);

// Whether calls are spread over several servers (a list, or dns:///), in turn, over those that are
// reached and say that they serve.
bool NamesSeveral(const std::string& server);

// What gRPC calls it.
std::string TargetName(const std::string& server);

// Whether every server that it names is on this machine. False for what only DNS can tell.
bool IsLoopback(const std::string& server);

}  // namespace hulld

#endif  // HULLD_CLIENT_SERVER_ADDRESS_H_
