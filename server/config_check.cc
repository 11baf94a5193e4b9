#include "server/config_check.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/access/secret_file.h"
#include "server/access/tls.h"
#include "server/access/token_table.h"
#include "server/contract/errors.h"
#include "server/process/listen_address.h"
#include "server/process/metrics_endpoint.h"
#include "server/store/postgres/session.h"

namespace hulld::server {

absl::Status CheckListening(const Config& config) {
  HULLD_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(config.listen));
  HULLD_RETURN_IF_ERROR(CheckExposure(address, config.has_tls(), config.insecure));
  if (config.metrics_address.empty()) return absl::OkStatus();
  return ParseMetricsAddress(config.metrics_address, config.metrics_insecure).status();
}

absl::StatusOr<std::vector<std::string>> CheckConfig(const Config& config,
                                                     std::chrono::system_clock::time_point now) {
  std::vector<std::string> findings;
  HULLD_RETURN_IF_ERROR(CheckListening(config));
  if (config.store == "rocksdb" && !config.data_dir.empty()) {
    HULLD_RETURN_IF_ERROR(CheckDataDir(config.data_dir));
  }
  if (config.store == "postgres") {
    HULLD_RETURN_IF_ERROR(CheckConninfoFile(config.postgres_conninfo_file));
  }
  if (config.has_tls()) {
    HULLD_ASSIGN_OR_RETURN(const TlsIdentity identity, LoadTlsIdentity(config));
    HULLD_RETURN_IF_ERROR(CheckValidity(identity, now));
    findings.push_back(absl::StrCat("TLS certificate of ", identity.subject, ", valid until ",
                                    FormatTime(identity.not_after)));
  }
  if (!config.tokens_file.empty()) {
    const absl::StatusOr<TokenTable> tokens = ReadTokensFile(config.tokens_file);
    if (!tokens.ok()) return tokens.status();
    findings.push_back(absl::StrCat(tokens->size(), tokens->size() == 1 ? " token" : " tokens"));
  }
  for (const std::string& warning : ExposureWarnings(config)) {
    findings.push_back(absl::StrCat("warning: ", warning));
  }
  return findings;
}

absl::Status CheckDataDir(const std::string& path) {
  const auto problem = [&path](const std::string& where, const std::string& what) {
    return InvalidArgument("--data-dir ", path, ": ", where, " ", what);
  };
  // A missing directory will be created in its nearest existing parent.
  std::error_code error;
  std::filesystem::path nearest = std::filesystem::absolute(path, error);
  if (error) return problem("the current directory", "does not exist");
  // A dangling link cannot be replaced by a directory.
  while (nearest.has_relative_path() &&
         !std::filesystem::exists(std::filesystem::symlink_status(nearest, error))) {
    nearest = nearest.parent_path();
  }
  if (!std::filesystem::is_directory(nearest, error)) {
    return problem(nearest.string(), "is not a directory");
  }
  if (access(nearest.c_str(), R_OK | W_OK | X_OK) != 0) {
    return problem(nearest.string(), "is not writable by the current user");
  }
  return absl::OkStatus();
}

absl::Status CheckConninfoFile(const std::string& path, const char* setting) {
  HULLD_ASSIGN_OR_RETURN(const std::string text, ReadSecretFile(path, setting));
  return Prefixed(absl::StrCat(setting, " ", path, ": "), ParseConninfo(text).status());
}

std::vector<std::string> ExposureWarnings(const Config& config) {
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  HULLD_CHECK(address.ok());
  if (address->is_local()) return {};
  std::vector<std::string> warnings;
  if (!config.has_tls()) {
    warnings.push_back(
        "the server is reachable from other machines without encryption (--insecure)");
  }
  if (config.tokens_file.empty() && config.tls_client_ca.empty()) {
    warnings.push_back(
        "every client that can reach this server may read and change everything; restrict access "
        "with --tokens-file or --tls-client-ca");
  }
  return warnings;
}

}  // namespace hulld::server
