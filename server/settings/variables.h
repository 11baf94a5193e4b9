#ifndef HULLD_SERVER_SETTINGS_VARIABLES_H_
#define HULLD_SERVER_SETTINGS_VARIABLES_H_

#include <absl/status/status.h>

#include <string>
#include <vector>

namespace hulld::server {

// Returns the names of this process's environment variables that start with "HULLD_".
std::vector<std::string> ProcessVariables();

// INVALID_ARGUMENT: one of the variables is likely a misspelled setting. Accepts other unknown
// names, such as the variables that Kubernetes sets for a service named hulld.
absl::Status CheckVariables(const std::vector<std::string>& names);

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_VARIABLES_H_
