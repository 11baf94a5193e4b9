#ifndef HULLD_SERVER_COLLISIONS_CLAIMED_RANGE_H_
#define HULLD_SERVER_COLLISIONS_CLAIMED_RANGE_H_

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "core/base/check.h"

namespace hulld::server {

// A range of work, [0, count), that several threads claim block by block, starting from its end.
// Unlike in ParallelLoop, no thread waits: the thread that completes the last block continues with
// the next step, and a thread that arrives after all blocks are claimed finds nothing. This also
// holds after the next range has begun or the owner has ended its work. Any thread may claim at any
// time.
class ClaimedRange {
 public:
  struct Block {
    uint32_t begin = 0;
    uint32_t end = 0;

    bool empty() const { return begin == end; }
  };

  // Begins a range. Earlier writes are visible to threads that claim its blocks. Requires that all
  // blocks of the previous range are complete.
  void Begin(uint32_t count) {
    HULLD_CHECK(left_.load(std::memory_order_relaxed) == 0);
    left_.store(count, std::memory_order_relaxed);
    unclaimed_.store(count, std::memory_order_release);
  }

  // Claims the next block, of at most `max_size`; empty if everything is claimed. Requires max_size
  // > 0.
  Block Claim(uint32_t max_size) {
    HULLD_CHECK(max_size > 0);
    uint32_t end = unclaimed_.load(std::memory_order_acquire);
    // Earlier reads do not matter: if a new range has begun since, the exchange makes it visible,
    // and the block belongs to it.
    while (end > 0) {
      const uint32_t begin = end - std::min(end, max_size);
      if (unclaimed_.compare_exchange_weak(end, begin, std::memory_order_acq_rel,
                                           std::memory_order_acquire)) {
        return {begin, end};
      }
    }
    return {};
  }

  // Records that the work on a claimed block is done. Returns true for exactly one caller, the
  // last, which sees the writes of all threads.
  bool Complete(const Block& block) {
    const uint32_t done = block.end - block.begin;
    return left_.fetch_sub(done, std::memory_order_acq_rel) == done;
  }

 private:
  std::atomic<uint32_t> unclaimed_ = 0;
  // Size of the part of the range that is not complete yet.
  std::atomic<uint32_t> left_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_CLAIMED_RANGE_H_
