#ifndef HULLD_SERVER_ACCESS_SECRET_FILE_H_
#define HULLD_SERVER_ACCESS_SECRET_FILE_H_

#include <absl/status/statusor.h>

#include <string>

namespace hulld::server {

// The contents of a small file; `setting` names it in errors, as in "--tls-cert". INVALID_ARGUMENT:
// it cannot be read, is no regular file, or holds more than 1 MiB.
absl::StatusOr<std::string> ReadSettingFile(const std::string& path, const std::string& setting);

// The same for a file that only we may read. INVALID_ARGUMENT also: it belongs to another user, or
// group or others can get at it. A file of root's may be readable by its group, so that a service
// can read what it must not change.
absl::StatusOr<std::string> ReadSecretFile(const std::string& path, const std::string& setting);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_SECRET_FILE_H_
