#ifndef HULLD_CORE_NUMERIC_SIMD_PATH_H_
#define HULLD_CORE_NUMERIC_SIMD_PATH_H_

#include <atomic>

// Defined if functions for AVX2 and AVX-512, or for NEON, exist in addition to the portable ones.
#if defined(__x86_64__)
#define HULLD_HAS_AVX2_PATH
#elif defined(__aarch64__)
#define HULLD_HAS_NEON_PATH
#endif

namespace hulld {

// The instruction set of loops over many points. Results are bit-identical on every path.
enum class SimdPath {
  kPortable,  // the baseline that all code is compiled for
  kAvx2,
  kAvx512,  // with VL and DQ; only for loops that need many registers, otherwise as kAvx2
  kNeon,    // on every 64-bit ARM; only for loops that the compiler does not vectorize
};

namespace internal {
extern std::atomic<SimdPath> simd_path;
}  // namespace internal

// Returns the best path of this machine, unless UseSimdPath has selected another.
inline SimdPath CurrentSimdPath() {
#if defined(HULLD_HAS_AVX2_PATH) || defined(HULLD_HAS_NEON_PATH)
  return internal::simd_path.load(std::memory_order_relaxed);
#else
  return SimdPath::kPortable;
#endif
}

// Returns true if the current path includes the functions for AVX2.
inline bool UsesAvx2() {
  const SimdPath path = CurrentSimdPath();
  return path == SimdPath::kAvx2 || path == SimdPath::kAvx512;
}

// Returns the best path of this machine.
SimdPath BestSimdPath();

// Selects the path for all threads. Returns false, and changes nothing, if the machine lacks it.
// For tests and benchmarks.
bool UseSimdPath(SimdPath path);

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_SIMD_PATH_H_
