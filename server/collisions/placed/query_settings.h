#ifndef HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_
#define HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "core/query/scene/scene.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call_lifetime.h"
#include "server/collisions/placed/placement_table.h"
#include "server/contract/errors.h"
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

// The pairs of a scene to query. Scene: a message with the groups and movers of a
// v1::FindCollisionsRequest.
//
// INVALID_ARGUMENT: the groups do not match the placements.
template <typename Scene>
absl::Status ValidateGroups(const Scene& scene, size_t placements) {
  if (!scene.groups().empty() && static_cast<size_t>(scene.groups_size()) != placements) {
    return InvalidArgument("groups has ", scene.groups_size(), " groups for ", placements,
                           " placements; set one per placement, or none");
  }
  if (scene.ignored_group_pairs_size() % 2 != 0) {
    return InvalidArgument("ignored_group_pairs has an odd number of groups, ",
                           scene.ignored_group_pairs_size(), "; each pair needs two");
  }
  if (scene.groups().empty() &&
      (scene.ignore_same_group() || !scene.ignored_group_pairs().empty())) {
    return InvalidArgument(scene.ignore_same_group() ? "ignore_same_group" : "ignored_group_pairs",
                           " requires groups; set one per placement");
  }
  if (scene.movers() > placements) {
    return InvalidArgument("movers is ", scene.movers(), ", but ", PlacementCountText(placements));
  }
  return absl::OkStatus();
}

// Returns the pairs of groups that are excluded from queries.
template <typename Scene>
std::vector<GroupPair> IgnoredGroups(const Scene& scene) {
  std::vector<GroupPair> ignored;
  for (int i = 0; i < scene.ignored_group_pairs_size(); i += 2) {
    ignored.push_back({scene.ignored_group_pairs(i), scene.ignored_group_pairs(i + 1)});
  }
  if (scene.ignore_same_group()) {
    const std::set<uint32_t> groups(scene.groups().begin(), scene.groups().end());
    for (const uint32_t group : groups) ignored.push_back({group, group});
  }
  return ignored;
}

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_QUERY_SETTINGS_H_
