#include "client/connection_security.h"

#include <absl/strings/str_cat.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/client_interceptor.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

#include "client/server_address.h"

namespace hulld {
namespace {

// Round robin over the servers that report SERVING.
constexpr char kSpreadCalls[] =
    R"({"loadBalancingConfig": [{"round_robin": {}}], "healthCheckConfig": {"serviceName": ""}})";

using grpc::experimental::ClientInterceptorFactoryInterface;
using grpc::experimental::ClientRpcInfo;
using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;

// Adds the token to every call of a channel, so that no call can omit it. (gRPC sends call
// credentials only over TLS, not even over unix sockets.)
class TokenSender : public Interceptor {
 public:
  explicit TokenSender(std::string authorization) : authorization_(std::move(authorization)) {}

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->emplace("authorization", authorization_);
    }
    methods->Proceed();
  }

 private:
  const std::string authorization_;
};

class TokenSenderFactory : public ClientInterceptorFactoryInterface {
 public:
  explicit TokenSenderFactory(const std::string& token) : authorization_("Bearer " + token) {}
  Interceptor* CreateClientInterceptor(ClientRpcInfo*) override {
    return new TokenSender(authorization_);
  }

 private:
  const std::string authorization_;
};

bool MaySendToken(const ConnectionSecurity& security, const std::string& server) {
  return security.tls || security.allow_plaintext_token || IsLoopback(server);
}

// Returns true if HTTP/2 allows the token as a header value.
bool IsToken(const std::string& token) {
  return !token.empty() &&
         std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 0x7F; });
}

}  // namespace

absl::Status ValidateSecurity(const ConnectionSecurity& security, const std::string& server) {
  if (security.certificate.empty() != security.key.empty()) {
    return absl::InvalidArgumentError("a client certificate requires its key; set both or neither");
  }
  // OpenSSL would ask for the passphrase on the terminal.
  if (security.key.find("ENCRYPTED") != std::string::npos) {
    return absl::InvalidArgumentError("the private key is encrypted; use one without a passphrase");
  }
  if (security.tls && security.server_name.empty() && TargetName(server) != server) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a list of addresses requires one certificate name; set it with --server-name"));
  }
  if (security.token.empty()) return absl::OkStatus();
  if (!IsToken(security.token)) {
    return absl::InvalidArgumentError("the token contains spaces or control characters");
  }
  if (MaySendToken(security, server)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the token would be sent unencrypted to ", server,
                                                 "; use TLS (--tls), or allow it with --insecure"));
}

std::shared_ptr<grpc::Channel> OpenChannel(const std::string& server,
                                           const ConnectionSecurity& security,
                                           const grpc::ChannelArguments& arguments) {
  grpc::ChannelArguments chosen = arguments;
  if (NamesSeveral(server)) chosen.SetServiceConfigJSON(kSpreadCalls);
  std::shared_ptr<grpc::ChannelCredentials> credentials;
  if (security.tls) {
    credentials = grpc::SslCredentials({security.authorities, security.key, security.certificate});
    if (!security.server_name.empty()) chosen.SetSslTargetNameOverride(security.server_name);
  } else {
    credentials = grpc::InsecureChannelCredentials();
  }
  std::vector<std::unique_ptr<ClientInterceptorFactoryInterface>> interceptors;
  if (IsToken(security.token) && MaySendToken(security, server)) {
    interceptors.push_back(std::make_unique<TokenSenderFactory>(security.token));
  }
  return grpc::experimental::CreateCustomChannelWithInterceptors(TargetName(server), credentials,
                                                                 chosen, std::move(interceptors));
}

absl::StatusOr<std::string> ReadTokenFile(const std::string& path) {
  const auto problem = [&path](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", what));
  };
  std::ifstream file(path);
  if (!file) return problem(std::strerror(errno));
  struct stat info = {};
  if (stat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode) && (info.st_mode & 0077) != 0) {
    return problem("the token is readable by other users; run chmod 600 on the file");
  }
  std::string token;
  std::string more;
  if (!(file >> token) || file >> more || !IsToken(token)) {
    return problem(
        "it must contain exactly one token, as written by 'hullctl token new --token-out'");
  }
  return token;
}

}  // namespace hulld
