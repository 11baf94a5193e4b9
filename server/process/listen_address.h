#ifndef HULLD_SERVER_PROCESS_LISTEN_ADDRESS_H_
#define HULLD_SERVER_PROCESS_LISTEN_ADDRESS_H_

#include <absl/status/statusor.h>

#include <string>

namespace hulld::server {

// Where the server listens.
struct ListenAddress {
  // Without brackets; empty for a unix socket.
  std::string host;
  // The number; empty for a unix socket.
  std::string port;
  // The socket's path; empty for TCP.
  std::string path;

  bool is_unix() const { return !path.empty(); }
  // Whether only this machine can reach it: unix sockets, 127.0.0.0/8, ::1 and localhost.
  bool is_local() const;
  // As gRPC and people write it, with `bound_port` in place of the port.
  std::string Format(int bound_port) const;
};

// Reads "host:port", "[v6]:port" or "unix:path". INVALID_ARGUMENT names the flag
// that the text was given to.
absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text,
                                                 const char* flag = "--listen");

// INVALID_ARGUMENT when others can reach the address, which would be without TLS, and `insecure`
// does not allow that.
absl::Status CheckExposure(const ListenAddress& address, bool has_tls, bool insecure);

// OK when no server listens on this unix socket (gRPC would take it over without a word), and for
// TCP.
absl::Status CheckSocketFree(const ListenAddress& address);

// Why the address could not be bound, by trying again: UNAVAILABLE with what to do.
absl::Status ExplainBindFailure(const ListenAddress& address, const char* flag = "--listen");

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_LISTEN_ADDRESS_H_
