#include "server/access/token_table.h"

#include <absl/status/status.h>
#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <sstream>

#include "core/base/status_macros.h"
#include "server/access/caller.h"
#include "server/access/secret_file.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

constexpr size_t kMaxNameCharacters = 64;
constexpr char kHashScheme[] = "sha256:";

bool IsName(const std::string& text) {
  return !text.empty() && text.size() <= kMaxNameCharacters &&
         CheckHullIdSyntax(text, "name").ok() && text.find('/') == std::string::npos;
}

std::optional<Permission> ReadRole(const std::string& text) {
  for (const Permission p : {Permission::kRead, Permission::kWrite, Permission::kAdmin}) {
    if (text == RoleName(p)) return p;
  }
  return std::nullopt;
}

absl::StatusOr<std::string> ReadPrefix(const std::string& text) {
  if (text == "*") return "";
  if (!text.ends_with("/")) {
    return InvalidArgument("the prefix \"", absl::Utf8SafeCEscape(text),
                           "\" must end in \"/\"; use \"*\" for all IDs");
  }
  HULLD_RETURN_IF_ERROR(CheckHullIdSyntax(text.substr(0, text.size() - 1), "the prefix"));
  return text;
}

bool IsHex(const std::string& text) { return std::ranges::all_of(text, absl::ascii_isxdigit); }

}  // namespace

absl::StatusOr<TokenTable> TokenTable::Parse(const std::string& text) {
  TokenTable table;
  std::istringstream lines(text);
  std::string line;
  for (size_t number = 1; std::getline(lines, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const absl::Status added = table.AddLine(line);
    if (!added.ok()) return Prefixed(absl::StrCat("line ", number, ": "), added);
  }
  return table;
}

absl::Status TokenTable::AddLine(const std::string& line) {
  std::istringstream words(line);
  std::string name;
  if (!(words >> name) || name.starts_with("#")) return absl::OkStatus();
  std::string role;
  std::string prefix;
  std::string hash;
  std::string more;
  if (!(words >> role >> prefix >> hash) || words >> more) {
    return InvalidArgument(
        "expected four fields: name, role, prefix, and sha256:HASH, as 'hullctl token new' prints "
        "them");
  }
  if (!IsName(name)) {
    return InvalidArgument(
        "the name (first field) must have at most 64 characters of [A-Za-z0-9._-] and start with a "
        "letter or digit");
  }
  Entry entry;
  entry.caller.name = name;
  const std::optional<Permission> permission = ReadRole(role);
  if (!permission.has_value()) {
    return InvalidArgument("the role (second field) must be read-only, read-write, or admin");
  }
  entry.caller.permission = *permission;
  HULLD_ASSIGN_OR_RETURN(entry.caller.prefix, ReadPrefix(prefix));
  const bool is_hash = hash.starts_with(kHashScheme) &&
                       hash.size() == sizeof kHashScheme - 1 + 2 * entry.hash.size() &&
                       IsHex(hash.substr(sizeof kHashScheme - 1));
  if (!is_hash) {
    return InvalidArgument(
        "the hash (last field) must be sha256: and 64 hexadecimal digits; never store the token "
        "itself ('hullctl token hash' prints its hash)");
  }
  const std::string bytes = absl::HexStringToBytes(hash.substr(sizeof kHashScheme - 1));
  std::copy(bytes.begin(), bytes.end(), entry.hash.begin());
  for (size_t i = 0; i < sizeof entry.caller.token; ++i) {
    entry.caller.token = entry.caller.token << 8 | entry.hash[i];
  }
  for (const Entry& other : entries_) {
    if (other.caller.name == name) {
      return InvalidArgument("the name \"", name, "\" is already used in an earlier line");
    }
    if (other.hash == entry.hash) {
      return InvalidArgument("\"", name, "\" has the token of \"", other.caller.name,
                             "\"; each name needs a token of its own");
    }
  }
  entries_.push_back(std::move(entry));
  return absl::OkStatus();
}

std::optional<Caller> TokenTable::Find(const std::string& token) const {
  Hash hash;
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash.data());
  const Entry* found = nullptr;
  for (const Entry& entry : entries_) {
    if (CRYPTO_memcmp(entry.hash.data(), hash.data(), hash.size()) == 0) found = &entry;
  }
  if (found == nullptr) return std::nullopt;
  return found->caller;
}

bool TokenTable::Knows(const Caller& caller) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.caller == caller; });
}

absl::StatusOr<TokenTable> ReadTokensFile(const std::string& path, bool may_be_empty) {
  if (may_be_empty && IsMissing(path)) return TokenTable();
  HULLD_ASSIGN_OR_RETURN(const std::string text, ReadSecretFile(path, "--tokens-file"));
  absl::StatusOr<TokenTable> table = TokenTable::Parse(text);
  if (!table.ok()) return Prefixed(absl::StrCat("--tokens-file ", path, ": "), table.status());
  if (table->empty() && !may_be_empty) {
    return InvalidArgument(
        "--tokens-file ", path,
        ": it contains no token, so every call would be refused; add one with 'hullctl token "
        "new'");
  }
  return table;
}

}  // namespace hulld::server
