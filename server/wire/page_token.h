#ifndef HULLD_SERVER_WIRE_PAGE_TOKEN_H_
#define HULLD_SERVER_WIRE_PAGE_TOKEN_H_

#include <absl/status/statusor.h>

#include <string>

#include "server/contract/rpc.h"

namespace hulld::server {

// Returns the opaque token of the page that starts after `last_id`, in this RPC's list of the IDs
// with `prefix`.
std::string EncodePageToken(Rpc rpc, const std::string& prefix, const std::string& last_id);

// Returns the last_id of a token of the same RPC and prefix; the empty string for an empty token.
// INVALID_ARGUMENT: the token is malformed, or belongs to another RPC or prefix.
absl::StatusOr<std::string> DecodePageToken(Rpc rpc, const std::string& token,
                                            const std::string& prefix);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_PAGE_TOKEN_H_
