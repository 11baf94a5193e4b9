#include "core/query/placed/support_blocks.h"

#include <cstring>
#include <limits>

#include "core/base/check.h"
#include "core/numeric/simd_path.h"

namespace hulld {
namespace {

// Four doubles, and four integers as wide, in whatever registers the function is compiled for.
using Lanes = double __attribute__((vector_size(32)));
using LaneIds = int64_t __attribute__((vector_size(32)));
// Above every index.
constexpr int64_t kNone = std::numeric_limits<int64_t>::max();

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
  // Which lane wins cannot be foreseen, so no branch depends on it.
  Lanes largest = best;
  Lanes other = __builtin_shufflevector(largest, largest, 2, 3, 0, 1);
  largest = largest > other ? largest : other;
  other = __builtin_shufflevector(largest, largest, 1, 0, 3, 2);
  largest = largest > other ? largest : other;
  // Where nothing is equal to itself, as for a direction that is not a number, any point will do.
  const LaneIds none = {kNone, kNone, kNone, kNone};
  LaneIds first = best >= largest ? best_ids : none;
  LaneIds other_ids = __builtin_shufflevector(first, first, 2, 3, 0, 1);
  first = first < other_ids ? first : other_ids;
  other_ids = __builtin_shufflevector(first, first, 1, 0, 3, 2);
  first = first < other_ids ? first : other_ids;
  return {first[0] == kNone ? 0 : static_cast<uint32_t>(first[0]), largest[0]};
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
