#ifndef HULLD_SERVER_ACCESS_TLS_IDENTITY_H_
#define HULLD_SERVER_ACCESS_TLS_IDENTITY_H_

#include <absl/status/statusor.h>

#include <chrono>
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

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_TLS_IDENTITY_H_
