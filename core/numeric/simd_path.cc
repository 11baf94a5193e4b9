#include "core/numeric/simd_path.h"

namespace hulld {

SimdPath BestSimdPath() {
#ifdef HULLD_HAS_AVX2_PATH
  __builtin_cpu_init();  // this may run before the constructor that initializes the CPU model
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
  if (path != SimdPath::kPortable && path != BestSimdPath()) return false;
  internal::simd_path.store(path, std::memory_order_relaxed);
  return true;
}

}  // namespace hulld
