#ifndef HULLD_SERVER_CONFIG_CHECK_H_
#define HULLD_SERVER_CONFIG_CHECK_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <string>
#include <vector>

#include "server/settings/config.h"

namespace hulld::server {

// Implements --check-config: verifies the settings as far as possible without starting. Returns the
// findings, one sentence each, without secrets. INVALID_ARGUMENT names the wrong setting, including
// a certificate that is not valid at `now`.
absl::StatusOr<std::vector<std::string>> CheckConfig(const Config& config,
                                                     std::chrono::system_clock::time_point now);

// OK if the settings allow listening, including metrics. INVALID_ARGUMENT names the setting.
absl::Status CheckListening(const Config& config);

// OK if this directory can hold a store: it is writable, or can be created. INVALID_ARGUMENT names
// --data-dir.
absl::Status CheckDataDir(const std::string& path);

// Returns OK if this file contains a PostgreSQL connection string that only the process's user can
// read; does not contact the database. INVALID_ARGUMENT names the setting that refers to the file,
// and quotes nothing from the file.
absl::Status CheckConninfoFile(const std::string& path,
                               const char* setting = "--postgres-conninfo-file");

// Returns warnings for the operator about access to the server, one sentence each. Requires a valid
// config.listen.
std::vector<std::string> ExposureWarnings(const Config& config);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONFIG_CHECK_H_
