#ifndef HULLD_SERVER_CONTRACT_HULL_ID_H_
#define HULLD_SERVER_CONTRACT_HULL_ID_H_

#include <absl/status/status.h>

#include <string>

namespace hulld::server {

// Returns OK if `id` is segments of [A-Za-z0-9][A-Za-z0-9._-]* joined by "/", at most 256
// characters; otherwise INVALID_ARGUMENT naming `field` (as in "a.hull_id") and the offending
// character. IDs of requests go through CheckHullId (caller.h), which also checks the caller's
// prefix.
absl::Status CheckHullIdSyntax(const std::string& id, const std::string& field);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_HULL_ID_H_
