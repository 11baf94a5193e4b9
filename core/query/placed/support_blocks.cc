#include "core/query/placed/support_blocks.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "core/base/check.h"
#include "core/numeric/simd_path.h"
#include "core/query/placed/lanes.h"

namespace hulld {
namespace {

// Above every index.
constexpr int64_t kNone = std::numeric_limits<int64_t>::max();

// Computes the values along (x, y, z) of four points.
[[gnu::always_inline]] inline void Evaluate(const SupportBlock& block, const Lanes& x,
                                            const Lanes& y, const Lanes& z, Lanes& values) {
  Lanes px, py, pz;
  Load(block.x, px);
  Load(block.y, py);
  Load(block.z, pz);
  values = (x * px + y * py) + z * pz;
}

// Returns the farthest point of whole blocks; the first of equal points. Requires: at least one
// block.
[[gnu::always_inline]] inline SupportPoint ScanWhole(std::span<const SupportBlock> blocks,
                                                     const PlainVector& n) {
  HULLD_DCHECK(!blocks.empty());
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
  // Branch-free: the winning lane is unpredictable.
  Lanes largest = best;
  Lanes other = __builtin_shufflevector(largest, largest, 2, 3, 0, 1);
  largest = largest > other ? largest : other;
  other = __builtin_shufflevector(largest, largest, 1, 0, 3, 2);
  largest = largest > other ? largest : other;
  // If no value equals itself, as for a NaN direction, any point is valid.
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
#endif

#ifdef HULLD_HAS_NEON_PATH
// ScanWhole with each vector of four lanes split into two registers of two lanes. For vectors wider
// than a register, the compiler would compare the lanes one by one.
using Pair = double __attribute__((vector_size(16)));
using PairIds = int64_t __attribute__((vector_size(16)));

inline Pair LoadPair(const double* from) {
  Pair pair;
  std::memcpy(&pair, from, sizeof pair);
  return pair;
}

SupportPoint ScanNeon(std::span<const SupportBlock> blocks, const PlainVector& n) {
  const Pair x = {n.x, n.x};
  const Pair y = {n.y, n.y};
  const Pair z = {n.z, n.z};
  const auto evaluate = [&](const SupportBlock& block, size_t i) __attribute__((always_inline)) {
    return (x * LoadPair(block.x + i) + y * LoadPair(block.y + i)) + z * LoadPair(block.z + i);
  };
  Pair low = evaluate(blocks[0], 0);
  Pair high = evaluate(blocks[0], 2);
  PairIds low_ids = {0, 1};
  PairIds high_ids = {2, 3};
  PairIds ids = low_ids;
  const PairIds two = {2, 2};
  const PairIds four = {4, 4};
  for (size_t i = 1; i < blocks.size(); ++i) {
    ids += four;
    const Pair low_values = evaluate(blocks[i], 0);
    const Pair high_values = evaluate(blocks[i], 2);
    const PairIds low_is_better = low_values > low;
    const PairIds high_is_better = high_values > high;
    low = low_is_better ? low_values : low;
    low_ids = low_is_better ? ids : low_ids;
    high = high_is_better ? high_values : high;
    high_ids = high_is_better ? ids + two : high_ids;
  }
  Pair low_largest = low > high ? low : high;
  Pair high_largest = high > low ? high : low;
  const Pair low_turned = __builtin_shufflevector(low_largest, low_largest, 1, 0);
  const Pair high_turned = __builtin_shufflevector(high_largest, high_largest, 1, 0);
  low_largest = low_largest > low_turned ? low_largest : low_turned;
  high_largest = high_largest > high_turned ? high_largest : high_turned;
  const PairIds none = {kNone, kNone};
  const PairIds low_first = low >= low_largest ? low_ids : none;
  const PairIds high_first = high >= high_largest ? high_ids : none;
  const PairIds both = low_first < high_first ? low_first : high_first;
  const int64_t first = std::min<int64_t>(both[0], both[1]);
  return {first == kNone ? 0 : static_cast<uint32_t>(first), low_largest[0]};
}
#endif

SupportPoint Scan(std::span<const SupportBlock> blocks, const PlainVector& n) {
#ifdef HULLD_HAS_AVX2_PATH
  if (UsesAvx2()) return ScanAvx2(blocks, n);
#endif
#ifdef HULLD_HAS_NEON_PATH
  if (CurrentSimdPath() == SimdPath::kNeon) return ScanNeon(blocks, n);
#endif
  return ScanPortably(blocks, n);
}

}  // namespace

SupportPoint FarthestOf(std::span<const SupportBlock> blocks, size_t count, const PlainVector& n) {
  HULLD_DCHECK(count > 0 && count <= 4 * blocks.size());
  const size_t whole = count / 4;
  SupportPoint best{0, -INFINITY};
  if (whole > 0) best = Scan(blocks.first(whole), n);
  for (size_t i = 4 * whole; i < count; ++i) {
    const SupportBlock& block = blocks[i / 4];
    const double value = SupportValue(n, block.x[i % 4], block.y[i % 4], block.z[i % 4]);
    if (value > best.value) best = {static_cast<uint32_t>(i), value};
  }
  return best;
}

}  // namespace hulld
