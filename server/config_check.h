#ifndef HULLD_SERVER_CONFIG_CHECK_H_
#define HULLD_SERVER_CONFIG_CHECK_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <string>
#include <vector>

#include "server/settings/config.h"

namespace hulld::server {

// What --check-config does: everything that can be known of the settings without starting. Returns
// what was found, a sentence each, none of it secret. INVALID_ARGUMENT names the setting that is
// wrong; a certificate that is not valid at `now` is.
absl::StatusOr<std::vector<std::string>> CheckConfig(const Config& config,
                                                     std::chrono::system_clock::time_point now);

// Whether the server may listen where the settings say, metrics included. INVALID_ARGUMENT names
// the setting.
absl::Status CheckListening(const Config& config);

// OK when a store can live in this directory: it can be written, or made where it is to be.
// INVALID_ARGUMENT names --data-dir.
absl::Status CheckDataDir(const std::string& path);

// OK when this file holds a connection string for PostgreSQL that only we may read; whether the
// database is there is not asked. INVALID_ARGUMENT names the setting that led to the file, and
// quotes nothing from the file.
absl::Status CheckConninfoFile(const std::string& path,
                               const char* setting = "--postgres-conninfo-file");

// What an operator should know about who can reach the server, a sentence each. Requires a valid
// config.listen.
std::vector<std::string> ExposureWarnings(const Config& config);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONFIG_CHECK_H_
