#ifndef HULLD_SERVER_COLLISIONS_WATCH_WATCHED_PAIRS_H_
#define HULLD_SERVER_COLLISIONS_WATCH_WATCHED_PAIRS_H_

#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/query/box_tree.h"
#include "core/query/terms/pair_cache.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/placed/placement_table.h"

namespace hulld::server {

// The state of a pair between answers.
struct WatchedPair {
  uint32_t a = 0;
  uint32_t b = 0;
  PairCache cache;
  // The last reported relation; SEPARATED for pairs that were not reported.
  v1::Relation relation = v1::RELATION_SEPARATED;
  bool is_within_clearance = false;
  bool is_asked = false;

  // True if the client has an event that says the pair is close.
  bool is_told() const { return relation != v1::RELATION_SEPARATED || is_within_clearance; }
};

// The pairs of a watch by placement, and the pairs that a change affects. A list names its pairs. A
// scene keeps the pairs that were reported and the pairs with bounding boxes that meet; all other
// pairs are farther apart than the clearance. Not thread-safe.
class WatchedPairs {
 public:
  WatchedPairs() = default;
  // open: its pairs, groups, and movers are valid for this number of placements. max_pairs: maximum
  // number of pairs kept for a scene (--max-pairs-per-batch).
  WatchedPairs(const v1::CollisionWatchOpen& open, size_t placements, uint64_t max_pairs);

  // Selects the pairs of the changed or moved placements, which are distinct, to be answered again,
  // including new pairs. RESOURCE_EXHAUSTED: more than max_pairs. Cost: O(n) per placement, or O(n
  // log n) for all of them, plus the number of pairs found.
  absl::Status AskAbout(std::span<const uint32_t> changed, const PlacementTable& table);
  // Clears the points in the caches of this placement's pairs, which no longer exist.
  void ForgetPoints(uint32_t placement);

  // Numbers of the selected pairs, until EndAsking.
  std::span<const uint32_t> asked() const { return asked_; }
  WatchedPair& pair(uint32_t number) { return pairs_[number]; }
  // Drops the selected pairs that need not be kept.
  void EndAsking();

  size_t MemoryBytes() const;

 private:
  bool MayCollide(uint32_t a, uint32_t b) const;
  uint32_t Add(uint32_t a, uint32_t b);
  void Drop(uint32_t number);
  void Ask(uint32_t number);
  absl::Status AskAboutNeighbors(std::span<const uint32_t> changed);
  absl::Status AskAboutPair(uint32_t a, uint32_t b);

  std::vector<WatchedPair> pairs_;
  // Pair numbers by placement.
  std::vector<std::vector<uint32_t>> pairs_of_;
  std::vector<uint32_t> asked_;

  bool is_scene_ = false;
  uint64_t max_pairs_ = 0;
  std::vector<uint32_t> groups_;
  std::set<std::pair<uint32_t, uint32_t>> ignored_;
  uint32_t movers_ = 0;
  double clearance_ = 0;
  std::vector<Box> boxes_;
  // Pair numbers by both placements; the lower placement is in the upper half of the key.
  std::unordered_map<uint64_t, uint32_t> numbers_;
  // Unused entries of pairs_.
  std::vector<uint32_t> free_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_WATCH_WATCHED_PAIRS_H_
