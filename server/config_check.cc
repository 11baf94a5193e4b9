#include "server/config_check.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include "server/listen_address.h"
#include "server/secret_file.h"
#include "server/tls_identity.h"
#include "server/token_table.h"

namespace hulld::server {
namespace {

absl::Status CheckListening(const Config& config) {
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (!address.ok()) return address.status();
  return CheckExposure(*address, config.has_tls(), config.insecure);
}

}  // namespace

absl::StatusOr<std::vector<std::string>> CheckConfig(const Config& config,
                                                     std::chrono::system_clock::time_point now) {
  std::vector<std::string> findings;
  if (absl::Status s = CheckListening(config); !s.ok()) return s;
  if (config.has_tls()) {
    const absl::StatusOr<TlsIdentity> identity = LoadTlsIdentity(config);
    if (!identity.ok()) return identity.status();
    if (absl::Status s = CheckValidity(*identity, now); !s.ok()) return s;
    findings.push_back(absl::StrCat("TLS certificate of ", identity->subject, ", valid until ",
                                    FormatTime(identity->not_after)));
  }
  if (!config.tokens_file.empty()) {
    const absl::StatusOr<TokenTable> tokens = ReadTokensFile(config.tokens_file);
    if (!tokens.ok()) return tokens.status();
    findings.push_back(absl::StrCat(tokens->size(), " tokens"));
  }
  for (const std::string& warning : ExposureWarnings(config)) {
    findings.push_back(absl::StrCat("warning: ", warning));
  }
  return findings;
}

std::vector<std::string> ExposureWarnings(const Config& config) {
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (!address.ok() || address->is_local()) return {};
  std::vector<std::string> warnings;
  if (!config.has_tls()) {
    warnings.push_back(
        "other machines can reach this server, and nothing is encrypted (--insecure)");
  }
  if (config.tokens_file.empty() && config.tls_client_ca.empty()) {
    warnings.push_back(
        "whoever can reach this server may read and change everything; limit that with "
        "--tokens-file or --tls-client-ca");
  }
  return warnings;
}

}  // namespace hulld::server
