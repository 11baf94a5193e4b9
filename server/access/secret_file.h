#ifndef HULLD_SERVER_ACCESS_SECRET_FILE_H_
#define HULLD_SERVER_ACCESS_SECRET_FILE_H_

#include <absl/status/statusor.h>

#include <string>

namespace hulld::server {

// Returns the contents of a small file. Errors name it by `setting`, as in "--tls-cert".
// INVALID_ARGUMENT: it cannot be read, is no regular file, or holds more than 1 MiB.
absl::StatusOr<std::string> ReadSettingFile(const std::string& path, const std::string& setting);

// Returns the contents of a file that only this user can access. INVALID_ARGUMENT also: it belongs
// to another user, or its permissions admit the group or the world. A file of root may be readable
// by its group, so that a service can read a file that it must not change.
absl::StatusOr<std::string> ReadSecretFile(const std::string& path, const std::string& setting);

// Returns true if no file has this path, following links. Returns false if that is unknown.
bool IsMissing(const std::string& path);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_SECRET_FILE_H_
