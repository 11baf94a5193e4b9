#include "server/access/caller.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/contract/rpc.h"
#include "server/settings/config.h"

namespace hulld::server {
namespace {

// Independent of the locale.
bool IsInner(char c) { return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '-'; }

absl::Status OutsidePrefix(const Caller& caller, const std::string& field,
                           const std::string& value) {
  return WithReason(
      absl::PermissionDeniedError(absl::StrCat(
          field, " \"", absl::Utf8SafeCEscape(value), "\" is outside the prefix \"", caller.prefix,
          "\" of token \"", caller.name, "\"; use an ID with that prefix, or another token")),
      v1::ERROR_REASON_OUTSIDE_PREFIX, {{"prefix", caller.prefix}});
}

}  // namespace

absl::Status CheckHullIdSyntax(const std::string& id, const std::string& field) {
  if (id.empty()) return InvalidArgument(field, " is empty; give an ID");
  if (id.size() > Config::kMaxIdCharacters) {
    return InvalidArgument(field, " has ", id.size(), " characters; the limit is ",
                           Config::kMaxIdCharacters);
  }
  bool segment_start = true;
  for (size_t i = 0; i <= id.size(); ++i) {
    const bool at_end = i == id.size() || id[i] == '/';
    if (at_end && segment_start) {
      return InvalidArgument(field, " \"", absl::Utf8SafeCEscape(id),
                             "\" has an empty segment at character ", i);
    }
    if (!at_end && !(segment_start ? absl::ascii_isalnum(id[i]) : IsInner(id[i]))) {
      return InvalidArgument(field, " \"", absl::Utf8SafeCEscape(id),
                             "\" is malformed at character ", i,
                             "; IDs are segments of [A-Za-z0-9][A-Za-z0-9._-]* joined by \"/\"");
    }
    segment_start = at_end;
  }
  return absl::OkStatus();
}

const char* RoleName(Permission permission) {
  static constexpr const char* kNames[] = {"none", "read-only", "read-write", "admin"};
  return kNames[static_cast<size_t>(permission)];
}

absl::Status CheckPermission(const Caller& caller, Rpc rpc) {
  const Permission needed = PermissionFor(rpc);
  if (caller.permission >= needed) return absl::OkStatus();
  return WithReason(absl::PermissionDeniedError(absl::StrCat(
                        "token \"", caller.name, "\" has the role ", RoleName(caller.permission),
                        ", but this call needs ", RoleName(needed), "; use another token")),
                    v1::ERROR_REASON_ROLE_TOO_LOW,
                    {{"role", RoleName(caller.permission)}, {"needed_role", RoleName(needed)}});
}

absl::Status CheckHullId(const Caller& caller, const std::string& id, const std::string& field) {
  HULLD_RETURN_IF_ERROR(CheckHullIdSyntax(id, field));
  if (id.starts_with(caller.prefix)) return absl::OkStatus();
  return OutsidePrefix(caller, field, id);
}

absl::StatusOr<std::string> PrefixToList(const Caller& caller, const std::string& prefix) {
  if (prefix.size() > Config::kMaxIdCharacters) {
    return InvalidArgument("prefix has ", prefix.size(), " characters; the limit is ",
                           Config::kMaxIdCharacters);
  }
  if (prefix.starts_with(caller.prefix)) return prefix;
  if (caller.prefix.starts_with(prefix)) return caller.prefix;
  return OutsidePrefix(caller, "prefix", prefix);
}

}  // namespace hulld::server
