#include "server/access/tls_credentials.h"

#include <grpc/grpc.h>

#include <utility>

namespace hulld::server {

TlsCredentials::TlsCredentials(TlsIdentity identity) : identity_(std::move(identity)) {
  const auto request = identity_.client_authorities.empty()
                           ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                           : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
  credentials_ = grpc_ssl_server_credentials_create_with_options(
      grpc_ssl_server_credentials_create_options_using_config_fetcher(request, Fetch, this));
}

TlsCredentials::~TlsCredentials() { grpc_server_credentials_release(credentials_); }

void TlsCredentials::SetIdentity(TlsIdentity identity) {
  const std::lock_guard lock(mutex_);
  identity_ = std::move(identity);
  fetched_ = false;
}

void TlsCredentials::SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) {
}

grpc_ssl_certificate_config_reload_status TlsCredentials::Fetch(
    void* self, grpc_ssl_server_certificate_config** config) {
  auto* const credentials = static_cast<TlsCredentials*>(self);
  const std::lock_guard lock(credentials->mutex_);
  if (credentials->fetched_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
  const TlsIdentity& identity = credentials->identity_;
  const grpc_ssl_pem_key_cert_pair pair = {identity.key.c_str(), identity.certificates.c_str()};
  // gRPC requires authorities even if it does not request client certificates.
  const bool has_authorities = !identity.client_authorities.empty();
  *config = grpc_ssl_server_certificate_config_create(
      (has_authorities ? identity.client_authorities : identity.certificates).c_str(), &pair, 1);
  credentials->fetched_ = true;
  return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
}

int TlsCredentials::AddPortToServer(const std::string& address, grpc_server* server) {
  return grpc_server_add_http2_port(server, address.c_str(), credentials_);
}

}  // namespace hulld::server
