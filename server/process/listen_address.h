#ifndef HULLD_SERVER_PROCESS_LISTEN_ADDRESS_H_
#define HULLD_SERVER_PROCESS_LISTEN_ADDRESS_H_

#include <absl/status/statusor.h>

#include <string>

namespace hulld::server {

// Address on which the server listens.
struct ListenAddress {
  // Without brackets; empty for a unix socket.
  std::string host;
  // The number; empty for a unix socket.
  std::string port;
  // The socket's path; empty for TCP.
  std::string path;

  bool is_unix() const { return !path.empty(); }
  // True if only this machine can reach it: unix sockets, 127.0.0.0/8, ::1 and localhost.
  bool is_local() const;
  // Formats the address in the usual notation, with `bound_port` in place of the port.
  std::string Format(int bound_port) const;
};

// Parses "host:port", "[v6]:port" or "unix:path". INVALID_ARGUMENT names the flag of the text.
absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text,
                                                 const char* flag = "--listen");

// INVALID_ARGUMENT: other machines can reach the address without TLS, and `insecure` is false.
absl::Status CheckExposure(const ListenAddress& address, bool has_tls, bool insecure);

// Returns an error if a server listens on this unix socket (gRPC would silently take it over). OK
// for TCP.
absl::Status CheckSocketFree(const ListenAddress& address);

// Returns UNAVAILABLE, with a remedy, for an address that cannot be bound. error: the errno, or 0
// if the host cannot be resolved. cause: the text of the error.
absl::Status BindFailure(const ListenAddress& address, int error, const std::string& cause,
                         const char* flag = "--listen");

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_LISTEN_ADDRESS_H_
