#ifndef HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_
#define HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_

#include <absl/status/statusor.h>

#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call_lifetime.h"
#include "server/collisions/placed/placement_table.h"
#include "server/settings/config.h"

namespace hulld::server {

// Returns core's options for a request. The query stops when the call of `lifetime` does;
// `lifetime` must outlive the query. INVALID_ARGUMENT, naming the field: an unknown method, a
// negative or NaN length, or mutually exclusive options.
absl::StatusOr<QueryOptions> MakeQueryOptions(v1::Method method, const v1::Wanted& wanted,
                                              double tolerance, const Limits& limits,
                                              const CallLifetime& lifetime);

// INVALID_ARGUMENT, naming the field: an option that is restricted to pairs of hulls.
absl::Status ValidateForBodies(const QueryOptions& options);

// Returns core's motion options for a request with these valid query options.
MotionOptions MakeMotionOptions(const v1::Wanted& wanted, const QueryOptions& options);

// INVALID_ARGUMENT, naming the field: an option that cannot be combined with motions.
absl::Status ValidateForMotions(const QueryOptions& options);

// Returns true if only relations are wanted and all placements are hulls at rest: the most frequent
// kind of call, which has a separate path.
inline bool WantsRelationsOfHulls(const QueryOptions& options, const PlacementTable& table) {
  return options.WantsRelationOnly() && !table.has_bodies() && !table.has_motions();
}

// Returns true if computing the relation of two such hulls takes no longer than moving the bytes of
// the request and response, so that a gRPC thread may compute it.
bool IsQuickToRelate(const QueryHull& hull);

// Converts an error of a query with these options to the server's error. RESOURCE_EXHAUSTED names
// the limit, and its flag or, if bodies need too many certificates, its reason.
absl::Status NameLimit(const absl::Status& status, const QueryOptions& options);

// RESOURCE_EXHAUSTED: the certificates of this many pairs of pieces need more than `limit` bytes.
absl::Status ProofTooLarge(uint64_t certificates, uint64_t limit);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_
