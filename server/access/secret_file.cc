#include "server/access/secret_file.h"

#include <absl/status/status.h>
#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "server/contract/errors.h"
#include "server/process/descriptors.h"

namespace hulld::server {
namespace {

constexpr size_t kMaxBytes = 1 << 20;

absl::Status Problem(const std::string& setting, const std::string& path, const std::string& what) {
  return InvalidArgument(setting, " ", path, ": ", what);
}

// Returns an empty string if only this user has access, or, for a file owned by root, its group.
std::string CheckAccess(const struct stat& info) {
  if (info.st_uid != 0 && info.st_uid != geteuid()) {
    return absl::StrFormat(
        "it belongs to user %d; chown it to root or to the user that runs hulld (%d)", info.st_uid,
        geteuid());
  }
  const mode_t allowed = info.st_uid == 0 ? 0740 : 0700;
  const mode_t mode = info.st_mode & 07777;
  if ((mode & ~allowed & 0077) == 0) return "";
  return absl::StrFormat("its permissions %04o are too open; run: chmod %s", mode,
                         info.st_uid == 0 ? "640 (or tighter)" : "600 (or tighter)");
}

absl::StatusOr<std::string> ReadFile(const std::string& path, const std::string& setting,
                                     bool secret) {
  const auto failed = [&] { return Problem(setting, path, std::strerror(errno)); };
  // Nonblocking, so that a pipe is recognized instead of waited for.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat info = {};
  if (file.number() < 0 || fstat(file.number(), &info) != 0) return failed();
  if (!S_ISREG(info.st_mode)) return Problem(setting, path, "it is not a regular file");
  if (secret) {
    const std::string problem = CheckAccess(info);
    if (!problem.empty()) return Problem(setting, path, problem);
  }
  std::string text;
  char buffer[4096];
  for (;;) {
    const ssize_t count = read(file.number(), buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failed();
    if (count == 0) return text;
    text.append(buffer, static_cast<size_t>(count));
    if (text.size() > kMaxBytes) return Problem(setting, path, "it is larger than 1 MiB");
  }
}

}  // namespace

absl::StatusOr<std::string> ReadSettingFile(const std::string& path, const std::string& setting) {
  return ReadFile(path, setting, false);
}

absl::StatusOr<std::string> ReadSecretFile(const std::string& path, const std::string& setting) {
  return ReadFile(path, setting, true);
}

bool IsMissing(const std::string& path) {
  struct stat info = {};
  return stat(path.c_str(), &info) != 0 && (errno == ENOENT || errno == ENOTDIR);
}

}  // namespace hulld::server
