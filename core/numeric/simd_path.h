#ifndef HULLD_CORE_NUMERIC_SIMD_PATH_H_
#define HULLD_CORE_NUMERIC_SIMD_PATH_H_

#include <atomic>

// Defined where functions for AVX2 or for NEON exist beside the portable ones.
#if defined(__x86_64__)
#define HULLD_HAS_AVX2_PATH
#elif defined(__aarch64__)
#define HULLD_HAS_NEON_PATH
#endif

namespace hulld {

// The instructions that loops over many points use. Results are the same bits on every path.
enum class SimdPath {
  kPortable,  // the baseline that all code is compiled for
  kAvx2,
  kNeon,  // part of every 64-bit ARM; loops that the compiler would not put into its registers
};

namespace internal {
extern std::atomic<SimdPath> simd_path;
}  // namespace internal

// The best path of this machine, unless UseSimdPath chose another.
inline SimdPath CurrentSimdPath() {
#if defined(HULLD_HAS_AVX2_PATH) || defined(HULLD_HAS_NEON_PATH)
  return internal::simd_path.load(std::memory_order_relaxed);
#else
  return SimdPath::kPortable;
#endif
}

// The best path of this machine.
SimdPath BestSimdPath();

// Makes every thread take this path from now on; false, and no change, when the machine lacks it.
// For tests and benchmarks.
bool UseSimdPath(SimdPath path);

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_SIMD_PATH_H_
