#include "core/numeric/simd_path.h"

namespace hulld {

SimdPath BestSimdPath() {
#ifdef HULLD_HAS_AVX2_PATH
  __builtin_cpu_init();  // this may run before the constructor that initializes the CPU model
  if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) {
    return SimdPath::kAvx512;
  }
  if (__builtin_cpu_supports("avx2")) return SimdPath::kAvx2;
#endif
#ifdef HULLD_HAS_NEON_PATH
  return SimdPath::kNeon;
#endif
  return SimdPath::kPortable;
}

namespace internal {
std::atomic<SimdPath> simd_path = BestSimdPath();
}  // namespace internal

bool UseSimdPath(SimdPath path) {
  const SimdPath best = BestSimdPath();
  const bool is_older = path == SimdPath::kAvx2 && best == SimdPath::kAvx512;
  if (path != SimdPath::kPortable && path != best && !is_older) return false;
  internal::simd_path.store(path, std::memory_order_relaxed);
  return true;
}

}  // namespace hulld
