#ifndef HULLD_SERVER_ACCESS_TLS_CREDENTIALS_H_
#define HULLD_SERVER_ACCESS_TLS_CREDENTIALS_H_

#include <grpc/grpc_security.h>
#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <mutex>
#include <string>

#include "server/access/tls_identity.h"

namespace hulld::server {

// TLS 1.2 or later with a replaceable identity. New connections use the latest identity, existing
// connections keep theirs. Clients need a certificate if the first identity has authorities.
//
// gRPC's C++ interface can only watch files, without checking that key and certificate match. This
// class therefore uses gRPC's core, which fetches the identity at each handshake.
class TlsCredentials : public grpc::ServerCredentials {
 public:
  explicit TlsCredentials(TlsIdentity identity);
  ~TlsCredentials() override;

  // Thread-safe. Requires: an identity from LoadTlsIdentity that has authorities if and only if the
  // first one had.
  void SetIdentity(TlsIdentity identity);

  // Does nothing: Guard authenticates calls.
  void SetAuthMetadataProcessor(
      const std::shared_ptr<grpc::AuthMetadataProcessor>& processor) override;

 private:
  static grpc_ssl_certificate_config_reload_status Fetch(
      void* self, grpc_ssl_server_certificate_config** config);

  int AddPortToServer(const std::string& address, grpc_server* server) override;

  std::mutex mutex_;
  TlsIdentity identity_;
  // True if gRPC has fetched identity_. Both are guarded by mutex_.
  bool fetched_ = false;
  grpc_server_credentials* credentials_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_TLS_CREDENTIALS_H_
