#ifndef HULLD_CORE_QUERY_SCENE_H_
#define HULLD_CORE_QUERY_SCENE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "core/query/batch.h"
#include "core/query/collision.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/rung.h"

namespace hulld {

// Two groups of placements; the same twice: pairs within that group.
struct GroupPair {
  uint32_t first;
  uint32_t second;
};

struct SceneOptions {
  // What is asked of each pair. A pair is found when it is not SEPARATED, or with a clearance when
  // its separation is within that. What else is wanted is computed of found pairs alone.
  QueryOptions query;
  // The group of each placement, or empty when there are no groups.
  std::span<const uint32_t> groups;
  // Pairs of groups that are never asked about.
  std::span<const GroupPair> ignored_groups;
  // One against many: only pairs with at least one of the first so many placements.
  std::optional<uint32_t> movers;
  // OpenMP threads.
  int threads = 1;
};

// A found pair, a < b, or one that could not be answered.
struct SceneAnswer {
  PlacedPair pair;
  absl::StatusOr<Answer> answer;
};

struct SceneTotals {
  // Pairs that the groups and movers leave, of these those whose boxes meet, of these those found.
  uint64_t pairs = 0;
  uint64_t candidates = 0;
  uint64_t found = 0;
  // Candidates by the rung that decided, in the order of Rung.
  std::array<uint64_t, kRungCount> by_rung = {};
};

// Which of all pairs of placements collide: a tree of bounding boxes leaves the pairs whose boxes
// meet, and each of these is answered as CheckCollision answers it. Answers are handed to `emit`,
// on the calling thread, in ascending order of (a, b); neither they nor their order depend on the
// number of threads. `emit` may wait, which holds the search back.
// INVALID_ARGUMENT: `groups` is neither empty nor one for each placement. CANCELLED: should_stop
// said so; what was emitted before stands. Cost: O(n log n) beyond the candidates.
absl::StatusOr<SceneTotals> FindCollisions(
    std::span<const PlacedHull> placements, const SceneOptions& options,
    const std::function<void(std::span<const SceneAnswer>)>& emit);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_SCENE_H_
