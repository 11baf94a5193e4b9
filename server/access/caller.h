#ifndef HULLD_SERVER_ACCESS_CALLER_H_
#define HULLD_SERVER_ACCESS_CALLER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

#include "server/contract/rpc.h"

namespace hulld::server {

// Returns the name of the role with this permission: "none", "read-only", "read-write", or "admin".
const char* RoleName(Permission permission);

// The client that makes a call, and its rights. The default, used by a server without tokens, has
// all rights.
struct Caller {
  // The token's name, which is not secret; empty without tokens.
  std::string name;
  Permission permission = Permission::kAdmin;
  // Prefix of all visible IDs: ends with "/", or is empty for all IDs.
  std::string prefix;
  // Distinguishes successive tokens with the same name. Never shown.
  uint64_t token = 0;

  bool sees_all() const { return prefix.empty(); }

  bool operator==(const Caller&) const = default;
};

// Returns OK if the caller may call this RPC. PERMISSION_DENIED names the required role.
absl::Status CheckPermission(const Caller& caller, Rpc rpc);

// Returns OK if `id` is well-formed and visible to the caller. Every hull ID of a request is
// checked before it is looked up. INVALID_ARGUMENT: see CheckHullIdSyntax. PERMISSION_DENIED: it is
// outside the caller's prefix, whether or not the hull exists.
absl::Status CheckHullId(const Caller& caller, const std::string& id, const std::string& field);

// Returns the narrower of `prefix` and the caller's prefix. INVALID_ARGUMENT: `prefix` is longer
// than any ID. PERMISSION_DENIED: no ID that starts with `prefix` is visible to the caller.
absl::StatusOr<std::string> PrefixToList(const Caller& caller, const std::string& prefix);

// Returns OK if `id` is segments of [A-Za-z0-9][A-Za-z0-9._-]* joined by "/", at most 256
// characters; otherwise INVALID_ARGUMENT naming `field` (as in "a.hull_id") and the offending
// character. IDs of requests go through CheckHullId, which also checks the caller's prefix.
absl::Status CheckHullIdSyntax(const std::string& id, const std::string& field);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_CALLER_H_
