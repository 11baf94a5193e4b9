#ifndef HULLD_SERVER_COLLISIONS_NEAREST_PAIRS_H_
#define HULLD_SERVER_COLLISIONS_NEAREST_PAIRS_H_

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <vector>

#include "core/query/box_tree.h"
#include "hulld/v1/collision.pb.h"

namespace hulld::server {

// Two placements, in the order of a scene that ranks its pairs. A pair without an answer is the
// last: its rank is infinite, which those of found pairs are not.
struct RankedPair {
  // As reported: the separation or, in motion, separated_until.
  double rank;
  uint32_t a;
  uint32_t b;
  v1::Relation relation;

  auto operator<=>(const RankedPair&) const = default;
};

// The nearest pairs of a scene: of all pairs added, the `limit` pairs of least separation, and the
// first `limit` pairs without an answer. The result does not depend on the order of additions.
// Thread-safe.
class NearestPairs {
 public:
  // boxes: one for each placement. max_error: the requested one, or 0.
  NearestPairs(size_t limit, std::vector<Box> boxes, double max_error);

  // Any pair whose exact separation exceeds this has `limit` nearer ones. Never increases.
  double bound() const { return bound_.load(std::memory_order_relaxed); }
  // False if the boxes prove that `limit` pairs are nearer than these placements, which do not
  // overlap. Cost: some ten operations.
  bool MayBeNear(uint32_t a, uint32_t b) const;

  void Add(const RankedPair& pair);
  void AddUnanswered(uint32_t a, uint32_t b);

  // Removes and returns the nearest pairs in ascending order, then those without an answer.
  std::vector<RankedPair> Take();

  // Upper bound of the memory, in a scene with this many pairs.
  size_t MaxMemoryBytes(uint64_t pairs) const;

 private:
  const size_t limit_;
  const std::vector<Box> boxes_;
  // Upper bound of the error of a reported separation near 0.
  double max_error_;
  std::atomic<double> bound_ = std::numeric_limits<double>::infinity();
  std::mutex mutex_;
  // Heaps, the greatest pair first; guarded by the mutex.
  std::vector<RankedPair> nearest_;
  std::vector<RankedPair> unanswered_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_NEAREST_PAIRS_H_
