#ifndef HULLD_SERVER_COLLISIONS_RANKED_PAIRS_H_
#define HULLD_SERVER_COLLISIONS_RANKED_PAIRS_H_

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "core/query/box_tree.h"
#include "hulld/v1/collision.pb.h"
#include "server/registry/memory/memory_budget.h"

namespace hulld::server {

// Two placements, in the order of a scene that ranks its pairs. A pair without an answer comes
// last: its rank is infinite, while the ranks of found pairs are finite.
struct RankedPair {
  // The reported separation or, in motion, the reported separated_until.
  double rank;
  uint32_t a;
  uint32_t b;
  v1::Relation relation;

  auto operator<=>(const RankedPair&) const = default;
};

// The pairs that a scene with a limit or first_only answers at the end, and the pairs without an
// answer. The result does not depend on the order of additions. Pairs that are separated until a
// time after earliest() need not be added. Thread-safe.
class RankedPairs {
 public:
  // Keeps the `limit` pairs with the smallest separation, and the first `limit` pairs without an
  // answer. boxes: one per placement. max_error: the requested value, or 0.
  RankedPairs(size_t limit, std::vector<Box> boxes, double max_error);
  // Keeps the pairs in motion that may be the first to touch: all pairs with a rank of at most the
  // smallest contact time; none if no contact is proven. Charges its memory to `charge`.
  explicit RankedPairs(MemoryCharge charge);

  // Without a limit: the smallest contact time so far.
  double earliest() const { return earliest_.load(std::memory_order_relaxed); }
  // With a limit: if the exact separation of a pair exceeds this bound, `limit` pairs are nearer.
  // Never increases.
  double bound() const { return bound_.load(std::memory_order_relaxed); }
  // With a limit: returns false if the boxes prove that `limit` pairs are nearer than these
  // placements. Requires that the placements do not overlap. Cost: about ten operations.
  bool MayBeNear(uint32_t a, uint32_t b) const;

  // contact_time: infinite with a limit, or if no contact is proven. Return true if the charge
  // grew.
  bool Add(const RankedPair& pair, double contact_time = kNever);
  bool AddUnanswered(uint32_t a, uint32_t b);

  // Removes and returns the kept pairs in ascending order, then those without an answer.
  std::vector<RankedPair> Take();

  // With a limit: upper bound on the memory, in a scene with this many pairs.
  size_t MaxMemoryBytes(uint64_t pairs) const;

  static constexpr double kNever = std::numeric_limits<double>::infinity();

 private:
  // Updates the charge. Returns true if it changed. Requires the mutex.
  bool Charge();

  const size_t limit_;
  const std::vector<Box> boxes_;
  // Upper bound on the error of a reported separation near 0.
  double max_error_ = 0;
  // Written under the mutex.
  std::atomic<double> bound_ = kNever;
  std::atomic<double> earliest_ = kNever;
  std::mutex mutex_;
  // The mutex guards the members below.
  // Heaps, the greatest pair first.
  std::vector<RankedPair> kept_;
  std::vector<RankedPair> unanswered_;
  // Without a limit.
  std::optional<MemoryCharge> charge_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_RANKED_PAIRS_H_
