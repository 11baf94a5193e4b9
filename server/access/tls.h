#ifndef HULLD_SERVER_ACCESS_TLS_H_
#define HULLD_SERVER_ACCESS_TLS_H_

#include <absl/status/statusor.h>
#include <grpc/grpc_security.h>
#include <grpcpp/security/server_credentials.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <string>

#include "server/settings/config.h"

namespace hulld::server {

// The server's certificates and key, and the authorities of its clients, as PEM.
struct TlsIdentity {
  // The server's certificate, then the chain to its authority.
  std::string certificates;
  std::string key;
  // Authorities of client certificates; empty: clients need no certificate.
  std::string client_authorities;

  // Subject and validity of the server's certificate.
  std::string subject;
  std::chrono::system_clock::time_point not_before;
  std::chrono::system_clock::time_point not_after;

  bool operator==(const TlsIdentity&) const = default;
};

// Reads --tls-cert, --tls-key, and --tls-client-ca, and checks that they are complete and match, so
// that a partial replacement of the files is detected. Requires: config.has_tls(). INVALID_ARGUMENT
// names the setting. An expired certificate is not an error here.
absl::StatusOr<TlsIdentity> LoadTlsIdentity(const Config& config);

// Returns true if --tls-client-ca is set and its file is missing or contains no PEM block.
bool HasLostAuthorities(const Config& config);
// Returns the first certificate of PEM text that LoadTlsIdentity accepted. Used as the client
// authority, it admits only the owner of its key.
std::string FirstCertificate(const std::string& certificates);

// Returns OK if the certificate is valid at `now`. INVALID_ARGUMENT: it has expired, or is not
// valid yet.
absl::Status CheckValidity(const TlsIdentity& identity, std::chrono::system_clock::time_point now);

// Returns the time in UTC, as in "2027-01-31T12:00:00Z".
std::string FormatTime(std::chrono::system_clock::time_point time);

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

#endif  // HULLD_SERVER_ACCESS_TLS_H_
