#ifndef HULLD_SERVER_COLLISIONS_CLAIMED_RANGE_H_
#define HULLD_SERVER_COLLISIONS_CLAIMED_RANGE_H_

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "core/base/check.h"

namespace hulld::server {

// A range of work, [0, count), that several threads claim block by block, from its end. Unlike in
// SharedLoop, nobody waits: the thread that gives back the last block goes on with what comes
// after, and a thread that comes when all is claimed finds nothing. That also holds once the next
// range has begun or this one's owner has ended its work. Any thread may claim at any time.
class ClaimedRange {
 public:
  struct Block {
    uint32_t begin = 0;
    uint32_t end = 0;

    bool empty() const { return begin == end; }
  };

  // Begins a range. A thread that claims a block of it sees what was written before. Requires that
  // the range before was given back.
  void Begin(uint32_t count) {
    HULLD_CHECK(left_.load(std::memory_order_relaxed) == 0);
    left_.store(count, std::memory_order_relaxed);
    unclaimed_.store(count, std::memory_order_release);
  }

  // The next block, of `most` at most; empty when all is claimed. Requires most > 0.
  Block Claim(uint32_t most) {
    HULLD_CHECK(most > 0);
    uint32_t end = unclaimed_.load(std::memory_order_acquire);
    // Nothing that was read before counts: where a range has begun meanwhile, the exchange shows it
    // whole, and the block is one of it.
    while (end > 0) {
      const uint32_t begin = end - std::min(end, most);
      if (unclaimed_.compare_exchange_weak(end, begin, std::memory_order_acq_rel,
                                           std::memory_order_acquire)) {
        return {begin, end};
      }
    }
    return {};
  }

  // Gives back a block that was claimed, once its work is done. True for one caller, the last, who
  // sees what all others wrote.
  bool GiveBack(const Block& block) {
    const uint32_t done = block.end - block.begin;
    return left_.fetch_sub(done, std::memory_order_acq_rel) == done;
  }

 private:
  std::atomic<uint32_t> unclaimed_ = 0;
  // Not given back.
  std::atomic<uint32_t> left_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_CLAIMED_RANGE_H_
