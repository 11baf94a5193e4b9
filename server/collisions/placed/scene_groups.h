#ifndef HULLD_SERVER_COLLISIONS_PLACED_SCENE_GROUPS_H_
#define HULLD_SERVER_COLLISIONS_PLACED_SCENE_GROUPS_H_

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "core/query/scene/scene.h"
#include "server/collisions/placed/placement_table.h"

// Pairs of a scene to query. Scene: a message with the groups and movers of a
// v1::FindCollisionsRequest.
namespace hulld::server {

// INVALID_ARGUMENT: the groups do not match the placements.
template <typename Scene>
absl::Status ValidateGroups(const Scene& scene, size_t placements) {
  if (!scene.groups().empty() && static_cast<size_t>(scene.groups_size()) != placements) {
    return absl::InvalidArgumentError(absl::StrCat("groups has ", scene.groups_size(),
                                                   " groups for ", placements,
                                                   " placements; set one per placement, or none"));
  }
  if (scene.ignored_group_pairs_size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("ignored_group_pairs has an odd number of groups, ",
                     scene.ignored_group_pairs_size(), "; each pair needs two"));
  }
  if (scene.groups().empty() &&
      (scene.ignore_same_group() || !scene.ignored_group_pairs().empty())) {
    return absl::InvalidArgumentError(
        absl::StrCat(scene.ignore_same_group() ? "ignore_same_group" : "ignored_group_pairs",
                     " requires groups; set one per placement"));
  }
  if (scene.movers() > placements) {
    return absl::InvalidArgumentError(
        absl::StrCat("movers is ", scene.movers(), ", but ", PlacementCountText(placements)));
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

#endif  // HULLD_SERVER_COLLISIONS_PLACED_SCENE_GROUPS_H_
