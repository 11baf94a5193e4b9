#ifndef HULLD_SERVER_COLLISIONS_PLACED_LIVE_PAIRS_H_
#define HULLD_SERVER_COLLISIONS_PLACED_LIVE_PAIRS_H_

#include <absl/status/status.h>
#include <google/protobuf/repeated_field.h>

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

// State of a pair between answers.
struct LivePair {
  uint32_t a = 0;
  uint32_t b = 0;
  PairCache cache = {};
  // As last reported.
  v1::Relation relation = v1::RELATION_UNSPECIFIED;
  bool is_within_clearance = false;
  bool is_selected = false;

  // Returns true if the pair was last reported as touching, overlapping, or within the clearance.
  bool is_reported() const { return relation != v1::RELATION_SEPARATED || is_within_clearance; }
};

// The pairs of a collision stream or watch, indexed by placement, and the selection of the current
// round. Contains all named pairs or, for a scene, only the reported pairs and the pairs whose
// bounding boxes, grown by the clearance, meet: all other pairs are farther apart than the
// clearance. Not thread-safe.
class LivePairs {
 public:
  LivePairs() = default;
  // Creates named pairs. Requires valid pairs for this many placements. relation: initial relation,
  // for pairs that were never reported.
  LivePairs(const google::protobuf::RepeatedField<uint32_t>& pairs, size_t placements,
            v1::Relation relation);
  // Creates the pairs of a scene or named pairs. Requires valid pairs, groups, and movers for this
  // many placements. max_pairs: maximum number of pairs of a scene to keep (--max-pairs-per-batch).
  LivePairs(const v1::CollisionWatchOpen& open, size_t placements, uint64_t max_pairs);

  // Select all pairs, or all pairs of a placement, that this object contains.
  void SelectAll();
  void SelectPairsOf(uint32_t placement);
  // Selects all pairs of the moved or changed placements, including new pairs. Each placement
  // occurs once in `changed`. RESOURCE_EXHAUSTED: more than max_pairs. Cost: O(n) per placement, or
  // O(n log n) in total, plus the number of selected pairs.
  absl::Status Select(std::span<const uint32_t> changed, const PlacementTable& table);
  // Clears the cached points of the placement's pairs, which refer to a previous hull.
  void ForgetPoints(uint32_t placement);

  // Numbers of the selected pairs.
  std::span<const uint32_t> selected() const { return selected_; }
  void SortSelected();
  size_t size() const { return pairs_.size(); }
  LivePair& pair(uint32_t number) { return pairs_[number]; }
  const LivePair& pair(uint32_t number) const { return pairs_[number]; }
  std::span<const uint32_t> pairs_of(uint32_t placement) const { return pairs_of_[placement]; }
  // Clears the selection and drops pairs that need not be kept.
  void EndRound();

  // Memory of this many named pairs and placements.
  static size_t BytesOf(size_t pairs, size_t placements);
  size_t MemoryBytes() const;

 private:
  bool MayCollide(uint32_t a, uint32_t b) const;
  uint32_t Add(uint32_t a, uint32_t b);
  void Drop(uint32_t number);
  void SelectOne(uint32_t number);
  absl::Status SelectNeighbors(std::span<const uint32_t> changed);
  absl::Status SelectPair(uint32_t a, uint32_t b);

  v1::Relation first_relation_ = v1::RELATION_UNSPECIFIED;
  std::vector<LivePair> pairs_;
  // Pair numbers by placement.
  std::vector<std::vector<uint32_t>> pairs_of_;
  std::vector<uint32_t> selected_;

  bool is_scene_ = false;
  uint64_t max_pairs_ = 0;
  std::vector<uint32_t> groups_;
  std::set<std::pair<uint32_t, uint32_t>> ignored_;
  uint32_t movers_ = 0;
  double clearance_ = 0;
  std::vector<Box> boxes_;
  // Pair numbers by key: both placements, the lower one in the upper half.
  std::unordered_map<uint64_t, uint32_t> numbers_;
  // Unused entries of pairs_.
  std::vector<uint32_t> free_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_LIVE_PAIRS_H_
