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

// What is kept of a pair from one answer to the next.
struct WatchedPair {
  uint32_t a = 0;
  uint32_t b = 0;
  PairCache cache;
  // As it was told last; SEPARATED of pairs that were not told of.
  v1::Relation relation = v1::RELATION_SEPARATED;
  bool is_within_clearance = false;
  bool is_asked = false;

  // Whether the client was told that it is close.
  bool is_told() const { return relation != v1::RELATION_SEPARATED || is_within_clearance; }
};

// The pairs of a watch by their placements, and which of them a change concerns. Pairs are those of
// a list, or, of a scene, those that were told and those whose bounding boxes meet: the others are
// farther apart than the clearance, so nothing is kept of them. Not thread-safe.
class WatchedPairs {
 public:
  WatchedPairs() = default;
  // The pairs of an `open` whose pairs, groups and movers are valid for this many placements.
  // max_pairs: the most pairs of a scene of which something is kept (--max-pairs-per-batch).
  WatchedPairs(const v1::CollisionWatchOpen& open, size_t placements, uint64_t max_pairs);

  // The pairs that these placements, which moved or changed, have or come to have are to be asked
  // about; each placement once. RESOURCE_EXHAUSTED: more than max_pairs. Cost: O(n) a placement, or
  // O(n log n) for all of them together, beyond what it finds.
  absl::Status AskAbout(std::span<const uint32_t> changed, const PlacementTable& table);
  // The points that the caches of these pairs name are no more.
  void ForgetPoints(uint32_t placement);

  // Those to be asked about, by number, until EndAsking.
  std::span<const uint32_t> asked() const { return asked_; }
  WatchedPair& pair(uint32_t number) { return pairs_[number]; }
  // Drops what need not be kept of those that were asked about.
  void EndAsking();

  // Bytes.
  size_t MemoryBytes() const;

 private:
  bool MayCollide(uint32_t a, uint32_t b) const;
  uint32_t Add(uint32_t a, uint32_t b);
  void Drop(uint32_t number);
  void Ask(uint32_t number);
  absl::Status AskAboutNeighbors(std::span<const uint32_t> changed);
  absl::Status AskAboutPair(uint32_t a, uint32_t b);

  std::vector<WatchedPair> pairs_;
  // The pairs of each placement.
  std::vector<std::vector<uint32_t>> pairs_of_;
  std::vector<uint32_t> asked_;

  bool is_scene_ = false;
  uint64_t max_pairs_ = 0;
  std::vector<uint32_t> groups_;
  std::set<std::pair<uint32_t, uint32_t>> ignored_;
  uint32_t movers_ = 0;
  double clearance_ = 0;
  std::vector<Box> boxes_;
  // By both placements, the lower one in the upper half.
  std::unordered_map<uint64_t, uint32_t> numbers_;
  // Places in pairs_ that hold none.
  std::vector<uint32_t> free_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_WATCH_WATCHED_PAIRS_H_
