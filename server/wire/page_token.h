#ifndef HULLD_SERVER_WIRE_PAGE_TOKEN_H_
#define HULLD_SERVER_WIRE_PAGE_TOKEN_H_

#include <absl/status/statusor.h>

#include <string>

namespace hulld::server {

// The opaque token of the page of IDs with `prefix` that starts after `last_id`.
std::string EncodePageToken(const std::string& prefix, const std::string& last_id);

// The last_id of a token made for the same prefix; the empty string for an empty token.
// INVALID_ARGUMENT: malformed, or made for another prefix.
absl::StatusOr<std::string> DecodePageToken(const std::string& token, const std::string& prefix);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_PAGE_TOKEN_H_
