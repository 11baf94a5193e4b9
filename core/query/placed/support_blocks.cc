#include "core/query/placed/support_blocks.h"

#include <cstring>

#include "core/base/check.h"
#include "core/numeric/simd_path.h"

namespace hulld {
namespace {

// Four doubles, and four integers as wide, in whatever registers the function is compiled for.
using Lanes = double __attribute__((vector_size(32)));
using LaneIds = int64_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void Load(const double* from, Lanes& lanes) {
  std::memcpy(&lanes, from, sizeof lanes);
}

[[gnu::always_inline]] inline void Broadcast(double value, Lanes& lanes) {
  lanes = Lanes{value, value, value, value};
}

// The values along (x, y, z) of four points.
[[gnu::always_inline]] inline void Evaluate(const SupportBlock& block, const Lanes& x,
                                            const Lanes& y, const Lanes& z, Lanes& values) {
  Lanes px, py, pz;
  Load(block.x, px);
  Load(block.y, py);
  Load(block.z, pz);
  values = (x * px + y * py) + z * pz;
}

// The farthest of whole blocks; of equal ones the first. Requires one block.
[[gnu::always_inline]] inline SupportPoint ScanWhole(std::span<const SupportBlock> blocks,
                                                     const PlainVector& n) {
  Lanes x, y, z, best, values;
  Broadcast(n.x, x);
  Broadcast(n.y, y);
  Broadcast(n.z, z);
  Evaluate(blocks[0], x, y, z, best);
  LaneIds best_ids = {0, 1, 2, 3};
  LaneIds ids = best_ids;
  const LaneIds four = {4, 4, 4, 4};
  for (size_t i = 1; i < blocks.size(); ++i) {
    ids += four;
    Evaluate(blocks[i], x, y, z, values);
    const LaneIds better = values > best;
    best = better ? values : best;
    best_ids = better ? ids : best_ids;
  }
  int lane = 0;
  for (int i = 1; i < 4; ++i) {
    if (best[i] > best[lane] || (best[i] == best[lane] && best_ids[i] < best_ids[lane])) lane = i;
  }
  return {static_cast<uint32_t>(best_ids[lane]), best[lane]};
}

SupportPoint ScanPortably(std::span<const SupportBlock> blocks, const PlainVector& n) {
  return ScanWhole(blocks, n);
}

#ifdef HULLD_HAS_AVX2_PATH
__attribute__((target("avx2"))) SupportPoint ScanAvx2(std::span<const SupportBlock> blocks,
                                                      const PlainVector& n) {
  return ScanWhole(blocks, n);
}
#else
SupportPoint ScanAvx2(std::span<const SupportBlock> blocks, const PlainVector& n) {
  return ScanPortably(blocks, n);
}
#endif

}  // namespace

SupportPoint FarthestOf(std::span<const SupportBlock> blocks, size_t count, const PlainVector& n) {
  HULLD_DCHECK(count > 0 && count <= 4 * blocks.size());
  const size_t whole = count / 4;
  SupportPoint best{0, -INFINITY};
  if (whole > 0) {
    const auto first = blocks.first(whole);
    best = CurrentSimdPath() == SimdPath::kAvx2 ? ScanAvx2(first, n) : ScanPortably(first, n);
  }
  for (size_t i = 4 * whole; i < count; ++i) {
    const SupportBlock& block = blocks[i / 4];
    const double value = SupportValue(n, block.x[i % 4], block.y[i % 4], block.z[i % 4]);
    if (value > best.value) best = {static_cast<uint32_t>(i), value};
  }
  return best;
}

}  // namespace hulld
