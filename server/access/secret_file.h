#ifndef HULLD_SERVER_ACCESS_SECRET_FILE_H_
#define HULLD_SERVER_ACCESS_SECRET_FILE_H_

#include <absl/status/statusor.h>

#include <string>

namespace hulld::server {

// Returns the contents of a small file. Errors name it by `setting`, as in "--tls-cert".
// INVALID_ARGUMENT: it cannot be read, is not a regular file, or is larger than 1 MiB.
absl::StatusOr<std::string> ReadSettingFile(const std::string& path, const std::string& setting);

// Returns the contents of a file that only this user can access. INVALID_ARGUMENT also: it belongs
// to another user, or its permissions allow access by the group or the world. A file owned by root
// may be readable by its group, so that a service can read a file that it must not change.
absl::StatusOr<std::string> ReadSecretFile(const std::string& path, const std::string& setting);

// Returns true if no file exists at this path, following links; false if that cannot be
// determined.
bool IsMissing(const std::string& path);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_SECRET_FILE_H_
