#ifndef HULLD_CLIENT_HULLCTL_CONTEXT_CONTEXT_FILE_H_
#define HULLD_CLIENT_HULLCTL_CONTEXT_CONTEXT_FILE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <map>
#include <string>

#include "client/hullctl/context/connection_settings.h"

namespace hulld {

// Servers by name, and the one that is used where nothing else is said.
struct ContextFile {
  // Empty: none.
  std::string current;
  std::map<std::string, ConnectionSettings> contexts;
};

// $XDG_CONFIG_HOME/hullctl/contexts.json, or ~/.config/hullctl/contexts.json; empty where neither
// variable says where.
std::string ContextFilePath();

// The file at ContextFilePath(); no contexts where there is none. INVALID_ARGUMENT names the file,
// what is wrong in it, and what to do.
absl::StatusOr<ContextFile> ReadContextFile();

// Replaces the file at once, so that readers see the former or the new one; only its owner may read
// it. Its folders are made. INVALID_ARGUMENT: it cannot be written.
absl::Status WriteContextFile(const ContextFile& file);

// Why the text cannot be a context's name, or nothing.
std::string ContextNameProblem(const std::string& name);

// The context of that name. INVALID_ARGUMENT: there is none; with those that there are.
absl::StatusOr<ConnectionSettings> FindContext(const ContextFile& file, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_CONTEXT_CONTEXT_FILE_H_
