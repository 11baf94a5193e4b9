#include "core/numeric/simd_path.h"

namespace hulld {
namespace {

SimdPath BestSimdPath() {
#ifdef HULLD_HAS_AVX2_PATH
  __builtin_cpu_init();  // this may run before the constructor that would do so
  if (__builtin_cpu_supports("avx2")) return SimdPath::kAvx2;
#endif
  return SimdPath::kPortable;
}

}  // namespace

namespace internal {
std::atomic<SimdPath> simd_path = BestSimdPath();
}  // namespace internal

bool UseSimdPath(SimdPath path) {
  if (path == SimdPath::kAvx2 && BestSimdPath() != SimdPath::kAvx2) return false;
  internal::simd_path.store(path, std::memory_order_relaxed);
  return true;
}

}  // namespace hulld
