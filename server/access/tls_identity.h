#ifndef HULLD_SERVER_ACCESS_TLS_IDENTITY_H_
#define HULLD_SERVER_ACCESS_TLS_IDENTITY_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <string>

#include "server/settings/config.h"

namespace hulld::server {

// What the server proves itself with, and whom it lets in, as PEM.
struct TlsIdentity {
  // The server's certificate first, then those that lead to its authority.
  std::string certificates;
  std::string key;
  // The authorities whose clients may connect; empty: clients need no certificate.
  std::string client_authorities;

  // The subject and the validity of the server's certificate.
  std::string subject;
  std::chrono::system_clock::time_point not_before;
  std::chrono::system_clock::time_point not_after;

  bool operator==(const TlsIdentity&) const = default;
};

// Reads --tls-cert, --tls-key and --tls-client-ca, and checks that they are whole and belong
// together, so that files caught in the middle of an exchange are told apart from good ones.
// Requires config.has_tls(). INVALID_ARGUMENT names the setting. A certificate that has expired is
// not an error here.
absl::StatusOr<TlsIdentity> LoadTlsIdentity(const Config& config);

// Why nobody would trust the certificate at `now`: INVALID_ARGUMENT when it has expired or is not
// valid yet.
absl::Status CheckValidity(const TlsIdentity& identity, std::chrono::system_clock::time_point now);

// "2027-01-31T12:00:00Z".
std::string FormatTime(std::chrono::system_clock::time_point time);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_TLS_IDENTITY_H_
