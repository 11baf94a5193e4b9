#ifndef HULLD_TESTS_BENCH_BENCH_RANDOM_H_
#define HULLD_TESTS_BENCH_BENCH_RANDOM_H_

#include <array>
#include <cmath>
#include <cstdint>
#include <random>

#include "core/numeric/vector.h"

namespace hulld::bench {

// Random numbers that are the same on every platform, unlike those of the standard distributions.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}

  double Between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  size_t Below(size_t n) { return engine_() % n; }

  // Marsaglia's rejection method.
  Vector UnitVector() {
    for (;;) {
      const Vector v(Between(-1, 1), Between(-1, 1), Between(-1, 1));
      const double squared = v.squaredNorm();
      if (squared > 0.01 && squared <= 1) return v / std::sqrt(squared);
    }
  }

  // Returns a quaternion of about unit length.
  std::array<double, 4> Rotation() {
    for (;;) {
      std::array<double, 4> q;
      double squared = 0;
      for (double& component : q) {
        component = Between(-1, 1);
        squared += component * component;
      }
      if (squared < 0.01 || squared > 1) continue;
      for (double& component : q) component /= std::sqrt(squared);
      return q;
    }
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_BENCH_RANDOM_H_
