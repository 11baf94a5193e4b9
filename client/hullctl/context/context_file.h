#ifndef HULLD_CLIENT_HULLCTL_CONTEXT_CONTEXT_FILE_H_
#define HULLD_CLIENT_HULLCTL_CONTEXT_CONTEXT_FILE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <map>
#include <memory>
#include <string>

#include "client/hullctl/context/connection_settings.h"

namespace hulld {

// Servers by name, and the default one.
struct ContextFile {
  // Empty: none.
  std::string current;
  std::map<std::string, ConnectionSettings> contexts;
  // Set by LockContextFile.
  std::shared_ptr<const void> lock = nullptr;
};

// Returns $XDG_CONFIG_HOME/hullctl/contexts.json, or ~/.config/hullctl/contexts.json; empty if
// neither variable is set.
std::string ContextFilePath();

// Reads the file at ContextFilePath(); a missing file has no contexts. INVALID_ARGUMENT names the
// file, the defect, and the remedy.
absl::StatusOr<ContextFile> ReadContextFile();

// Blocks until no other program changes the file, and reads it. The lock lasts as long as the
// result, so that no change is lost. Without a lock if the file system supports none.
absl::StatusOr<ContextFile> LockContextFile();

// Replaces the file, or the target of a symbolic link, atomically; only its owner may read it.
// Creates missing folders. INVALID_ARGUMENT: it cannot be written.
absl::Status WriteContextFile(const ContextFile& file);

// Returns the reason why the text cannot be a context name; empty if it can.
std::string ContextNameProblem(const std::string& name);

// Returns the context of that name. INVALID_ARGUMENT: it does not exist; lists the existing ones.
absl::StatusOr<ConnectionSettings> FindContext(const ContextFile& file, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_CONTEXT_CONTEXT_FILE_H_
