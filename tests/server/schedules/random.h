#ifndef HULLD_TESTS_SERVER_SCHEDULES_RANDOM_H_
#define HULLD_TESTS_SERVER_SCHEDULES_RANDOM_H_

#include <cstdint>

namespace hulld::server {

// SplitMix64: the same numbers for the same seed on every platform, and good ones for consecutive
// seeds. Cost: ~1 ns. Source: Steele, Lea and Flood 2014, Fast Splittable Pseudorandom Number
// Generators.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}

  uint64_t Next() {
    uint64_t z = state_ += 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
  }
  // Returns a number below n, or 0 for n = 0. Nearly uniform: the bias is one in 2^32.
  uint32_t Below(uint32_t n) { return static_cast<uint32_t>(((Next() >> 32) * n) >> 32); }
  // True with probability 1/n; never for n = 0.
  bool OneIn(uint32_t n) { return n > 0 && Below(n) == 0; }

 private:
  uint64_t state_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_RANDOM_H_
