#ifndef HULLD_SERVER_ACCESS_CALLER_H_
#define HULLD_SERVER_ACCESS_CALLER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

namespace hulld::server {

enum class Rpc;

// What a caller may do; each includes those before it.
enum class Permission {
  // Needs no token.
  kNone,
  // Asks; changes nothing.
  kRead,
  // Creates, changes and deletes hulls.
  kWrite,
  // Concerns the store as a whole.
  kAdmin,
};

// The name of the role that has this permission: "read-only", "read-write" or "admin"; "none" has
// none.
const char* RoleName(Permission permission);

// What a call needs: the one table of that.
Permission PermissionFor(Rpc rpc);

// The caller of a call, and what the caller may do and see. The default is the caller of a server
// without tokens, who may do everything.
struct Caller {
  // The token's name; empty without tokens. It is no secret.
  std::string name;
  Permission permission = Permission::kAdmin;
  // What the IDs that the caller sees start with: ends in "/", or is empty for all.
  std::string prefix;
  // Tells the tokens apart that had this name one after another. Never shown.
  uint64_t token = 0;

  bool sees_all() const { return prefix.empty(); }

  bool operator==(const Caller&) const = default;
};

// PERMISSION_DENIED, naming the role that is missing, unless the caller may call this.
absl::Status CheckPermission(const Caller& caller, Rpc rpc);

// Every hull ID of a request goes through here before anything is looked up by it. OK when `id` is
// well-formed and the caller's. INVALID_ARGUMENT: as CheckHullIdSyntax. PERMISSION_DENIED: it is
// not under the caller's prefix, whether or not such a hull exists.
absl::Status CheckHullId(const Caller& caller, const std::string& id, const std::string& field);

// The prefix to list for a caller who asks for `prefix`: the narrower of the two.
// INVALID_ARGUMENT: longer than any ID. PERMISSION_DENIED when nothing the caller sees can start
// with it.
absl::StatusOr<std::string> PrefixToList(const Caller& caller, const std::string& prefix);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_CALLER_H_
