#ifndef HULLD_SERVER_COLLISIONS_FIRST_PAIRS_H_
#define HULLD_SERVER_COLLISIONS_FIRST_PAIRS_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <utility>
#include <vector>

#include "server/collisions/nearest_pairs.h"
#include "server/registry/memory/memory_budget.h"

namespace hulld::server {

// The pairs of a scene in motion that may be the first to touch: of all pairs added, those whose
// rank does not exceed the least contact time; and the pairs without an answer. The result does not
// depend on the order of additions. Thread-safe.
class FirstPairs {
 public:
  // Charges its memory to `charge`.
  explicit FirstPairs(MemoryCharge charge) : charge_(std::move(charge)) {}

  // contact_time: infinite if no contact is proven. Returns true if the memory grew.
  bool Add(const RankedPair& pair, double contact_time);
  bool AddUnanswered(uint32_t a, uint32_t b);

  // Removes and returns the first pairs in ascending order, none if no contact is proven, then
  // those without an answer.
  std::vector<RankedPair> Take();

 private:
  // Require the mutex.
  void DropLater();
  bool Charge();

  std::mutex mutex_;
  double earliest_ = std::numeric_limits<double>::infinity();
  std::vector<RankedPair> pairs_;
  // Number of pairs after the last DropLater.
  size_t kept_ = 0;
  std::vector<RankedPair> unanswered_;
  MemoryCharge charge_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_FIRST_PAIRS_H_
