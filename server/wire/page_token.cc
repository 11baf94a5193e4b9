#include "server/wire/page_token.h"

#include <absl/status/status.h>
#include <absl/strings/escaping.h>

#include "server/contract/hull_id.h"

namespace hulld::server {
namespace {

// No ID holds a NUL.
constexpr char kSeparator = '\0';

}  // namespace

std::string EncodePageToken(const std::string& prefix, const std::string& last_id) {
  return absl::WebSafeBase64Escape(prefix + kSeparator + last_id);
}

absl::StatusOr<std::string> DecodePageToken(const std::string& token, const std::string& prefix) {
  if (token.empty()) return std::string();
  std::string plain;
  const bool decoded = absl::WebSafeBase64Unescape(token, &plain);
  const size_t separator = plain.rfind(kSeparator);
  if (!decoded || separator == std::string::npos) {
    return absl::InvalidArgumentError(
        "page_token is malformed; pass next_page_token of the previous page, or none");
  }
  if (plain.substr(0, separator) != prefix) {
    return absl::InvalidArgumentError(
        "page_token belongs to another prefix; list with the prefix of the first page");
  }
  const std::string last_id = plain.substr(separator + 1);
  if (!CheckHullIdSyntax(last_id, "page_token").ok() || !last_id.starts_with(prefix)) {
    return absl::InvalidArgumentError(
        "page_token is malformed; pass next_page_token of the previous page, or none");
  }
  return last_id;
}

}  // namespace hulld::server
