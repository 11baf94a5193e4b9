#include "server/wire/unary_answers.h"

#include <absl/status/status.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_split.h>

#include <vector>

#include "server/access/caller.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

// IDs contain no NUL.
constexpr char kSeparator = '\0';

}  // namespace

std::string EncodePageToken(Rpc rpc, const std::string& prefix, const std::string& last_id) {
  return absl::WebSafeBase64Escape(std::string(RpcName(rpc)) + kSeparator + prefix + kSeparator +
                                   last_id);
}

absl::StatusOr<std::string> DecodePageToken(Rpc rpc, const std::string& token,
                                            const std::string& prefix) {
  if (token.empty()) return std::string();
  const absl::Status malformed = InvalidArgument(
      "page_token is malformed; use next_page_token of the previous page, or leave it empty");
  std::string plain;
  if (!absl::WebSafeBase64Unescape(token, &plain)) return malformed;
  const std::vector<std::string> parts = absl::StrSplit(plain, kSeparator);
  if (parts.size() != 3) return malformed;
  if (parts[0] != RpcName(rpc)) {
    return InvalidArgument("page_token belongs to a call other than ", RpcName(rpc),
                           "; use the call of the first page");
  }
  if (parts[1] != prefix) {
    return InvalidArgument(
        "page_token belongs to another prefix; use the prefix of the first page");
  }
  const std::string& last_id = parts[2];
  if (!CheckHullIdSyntax(last_id, "page_token").ok() || !last_id.starts_with(prefix)) {
    return malformed;
  }
  return last_id;
}

}  // namespace hulld::server
