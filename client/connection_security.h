#ifndef HULLD_CLIENT_CONNECTION_SECURITY_H_
#define HULLD_CLIENT_CONNECTION_SECURITY_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/channel.h>
#include <grpcpp/support/channel_arguments.h>

#include <memory>
#include <string>

namespace hulld {

// How a connection is protected and who we are.
struct ConnectionSecurity {
  // TLS; without it nothing is encrypted, and the next four are not used.
  bool tls = false;
  // PEM: the authorities that the server's certificate may come from; empty: those of the system.
  std::string authorities;
  // PEM: our certificate and its key, for a server that asks for one; both or neither.
  std::string certificate;
  std::string key;
  // The name that the server's certificate must bear, where it is not that of the address.
  std::string server_name;

  // Sent with each call as "authorization: Bearer TOKEN"; empty: none.
  std::string token;
  // Lets the token go unencrypted to other machines.
  bool allow_plaintext_token = false;
};

// INVALID_ARGUMENT: what is missing, or that the token would be readable on its way to `server`.
absl::Status ValidateSecurity(const ConnectionSecurity& security, const std::string& server);

// A channel to `server` (see server_address.h). A token that ValidateSecurity objects to is not
// sent.
std::shared_ptr<grpc::Channel> OpenChannel(const std::string& server,
                                           const ConnectionSecurity& security,
                                           const grpc::ChannelArguments& arguments);

// Reads a file that holds a token: one line. INVALID_ARGUMENT: it cannot be read, others can read
// it too, or it holds no token. Errors never repeat its text.
absl::StatusOr<std::string> ReadTokenFile(const std::string& path);

}  // namespace hulld

#endif  // HULLD_CLIENT_CONNECTION_SECURITY_H_
