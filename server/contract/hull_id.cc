#include "server/contract/hull_id.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

#include "server/settings/config.h"

namespace hulld::server {
namespace {

// Independent of the locale.
bool IsInner(char c) { return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '-'; }

}  // namespace

absl::Status CheckHullIdSyntax(const std::string& id, const std::string& field) {
  if (id.empty()) return absl::InvalidArgumentError(absl::StrCat(field, " is empty; give an ID"));
  if (id.size() > Config::kMaxIdCharacters) {
    return absl::InvalidArgumentError(absl::StrCat(
        field, " has ", id.size(), " characters; the limit is ", Config::kMaxIdCharacters));
  }
  bool segment_start = true;
  for (size_t i = 0; i <= id.size(); ++i) {
    const bool at_end = i == id.size() || id[i] == '/';
    if (at_end && segment_start) {
      return absl::InvalidArgumentError(absl::StrCat(field, " \"", absl::Utf8SafeCEscape(id),
                                                     "\" has an empty segment at character ", i));
    }
    if (!at_end && !(segment_start ? absl::ascii_isalnum(id[i]) : IsInner(id[i]))) {
      return absl::InvalidArgumentError(
          absl::StrCat(field, " \"", absl::Utf8SafeCEscape(id), "\" is malformed at character ", i,
                       "; IDs are segments of [A-Za-z0-9][A-Za-z0-9._-]* joined by \"/\""));
    }
    segment_start = at_end;
  }
  return absl::OkStatus();
}

}  // namespace hulld::server
