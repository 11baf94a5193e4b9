#ifndef HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_
#define HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_

#include <absl/status/statusor.h>

#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call_lifetime.h"
#include "server/collisions/placed/placement_table.h"
#include "server/settings/config.h"

namespace hulld::server {

// The options of core for what a request wants; the query ends with `lifetime`, which must outlive
// it. INVALID_ARGUMENT, naming the field: a number that stands for no method, a length that is
// negative or NaN, or wishes that exclude each other.
absl::StatusOr<QueryOptions> MakeQueryOptions(v1::Method method, const v1::Wanted& wanted,
                                              double tolerance, const Limits& limits,
                                              const CallLifetime& lifetime);

// OK, or INVALID_ARGUMENT naming the field: what is for pairs of hulls alone.
absl::Status ValidateForBodies(const QueryOptions& options);

// Whether all that is wanted are relations, and all that is placed are hulls: the most frequent
// call, which has a path of its own.
inline bool AsksRelationsOfHulls(const QueryOptions& options, const PlacementTable& table) {
  return options.WantsRelationOnly() && !table.has_bodies();
}

// Whether the relation of this hull and another such takes no longer than moving the bytes of the
// question and of the answer does, so that one of gRPC's threads may find it.
bool IsQuickToRelate(const QueryHull& hull);

// Whether the textbook's axes of this pair are worth a team of threads (Executor); always false for
// other methods. Requires canonical hulls for the textbook. Cost: a few operations, whatever the
// size of the hulls.
bool IsTextbookForTeam(const QueryOptions& options, const PlacedHull& a, const PlacedHull& b);

// An error of a query with these options in the words of the server: RESOURCE_EXHAUSTED names the
// limit and its flag.
absl::Status NameQueryLimit(const absl::Status& status, const QueryOptions& options);

// The same of a question about bodies: RESOURCE_EXHAUSTED means that it would need too many
// certificates.
absl::Status NameProofLimit(const absl::Status& status);

// RESOURCE_EXHAUSTED: the certificates of this many pairs of pieces take more than `limit` bytes.
absl::Status ProofTooLarge(uint64_t certificates, uint64_t limit);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_
