#ifndef HULLD_SERVER_ACCESS_TLS_CREDENTIALS_H_
#define HULLD_SERVER_ACCESS_TLS_CREDENTIALS_H_

#include <grpc/grpc_security.h>
#include <grpcpp/security/server_credentials.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "server/access/tls_identity.h"

namespace hulld::server {

// TLS 1.2 or later with an identity that can be exchanged: connections made after SetIdentity use
// the new one, and existing connections stay. Clients need a certificate when the first identity
// names authorities.
//
// gRPC's C++ interface offers this only by watching files, which it takes as they come, whether
// or not key and certificate belong together; so this goes to its core, which asks for the identity
// at each handshake.
class TlsCredentials : public grpc::ServerCredentials {
 public:
  explicit TlsCredentials(TlsIdentity identity);
  ~TlsCredentials() override;

  // Any thread. Requires an identity as LoadTlsIdentity gives it, that names authorities if and
  // only if the first did.
  void SetIdentity(TlsIdentity identity);

  // Not supported: Call authenticates. Does nothing.
  void SetAuthMetadataProcessor(
      const std::shared_ptr<grpc::AuthMetadataProcessor>& processor) override;

 private:
  static grpc_ssl_certificate_config_reload_status Fetch(
      void* self, grpc_ssl_server_certificate_config** config);

  int AddPortToServer(const std::string& address, grpc_server* server) override;

  std::mutex mutex_;
  TlsIdentity identity_;
  // Whether gRPC has seen identity_. Both guarded by the mutex.
  bool fetched_ = false;
  grpc_server_credentials* credentials_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_TLS_CREDENTIALS_H_
