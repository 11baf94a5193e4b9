#ifndef HULLD_CLIENT_CONNECTION_SECURITY_H_
#define HULLD_CLIENT_CONNECTION_SECURITY_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/channel.h>
#include <grpcpp/support/channel_arguments.h>

#include <memory>
#include <string>

namespace hulld {

// Protection of a connection, and the client's credentials.
struct ConnectionSecurity {
  // Enables TLS. Without TLS, nothing is encrypted, and the next four fields are ignored.
  bool tls = false;
  // PEM of the authorities trusted to sign the server's certificate. If empty, the system's
  // authorities.
  std::string authorities;
  // PEM of the client's certificate and key, for a server that requires a client certificate. Set
  // both or neither.
  std::string certificate;
  std::string key;
  // Name expected in the server's certificate, if it differs from the address.
  std::string server_name;

  // Token sent with each call as "authorization: Bearer TOKEN", if not empty.
  std::string token;
  // Allows sending the token unencrypted to another machine.
  bool allow_plaintext_token = false;
};

// INVALID_ARGUMENT: a setting is missing, or the token would reach `server` unencrypted.
absl::Status ValidateSecurity(const ConnectionSecurity& security, const std::string& server);

// Returns a channel to `server` (see server_address.h). A token that ValidateSecurity rejects is
// not sent.
std::shared_ptr<grpc::Channel> OpenChannel(const std::string& server,
                                           const ConnectionSecurity& security,
                                           const grpc::ChannelArguments& arguments);

// Reads a token file: a single line. INVALID_ARGUMENT: the file cannot be read, other users can
// read it, or it contains no token. Errors never quote its text.
absl::StatusOr<std::string> ReadTokenFile(const std::string& path);

}  // namespace hulld

#endif  // HULLD_CLIENT_CONNECTION_SECURITY_H_
