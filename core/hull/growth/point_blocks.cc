#include "core/hull/growth/point_blocks.h"

#include "core/base/check.h"
#include "core/numeric/simd_path.h"

namespace hulld {
namespace {

// Four doubles, and four truth values; the compiler splits them into the target's registers.
using Lanes = double __attribute__((vector_size(32)));
using Mask = int64_t __attribute__((vector_size(32)));

// Four points and their results so far.
struct FourMatches {
  explicit FourMatches(const PointBlock& block) {
    __builtin_memcpy(&x, block.x, sizeof(x));
    __builtin_memcpy(&y, block.y, sizeof(y));
    __builtin_memcpy(&z, block.z, sizeof(z));
  }
  __attribute__((always_inline)) void Test(const PlaneWithLimits& plane, const Mask& index) {
    const Lanes product = plane.normal[0] * x + plane.normal[1] * y + plane.normal[2] * z;
    const Lanes height = product - plane.above;
    const Mask is_better = height > best;
    best = is_better ? height : best;
    match = is_better ? index : match;
    is_maybe_above |= ~(product < plane.below);
  }
  // Writes the matches, and sets are_uncertain for uncertain points.
  __attribute__((always_inline)) void Finish(int64_t* matches, Mask& are_uncertain) {
    const Mask is_uncertain = is_maybe_above & (match == kBelowAll);
    match += is_uncertain;
    __builtin_memcpy(matches, &match, sizeof(match));
    are_uncertain |= is_uncertain;
  }

  Lanes x;
  Lanes y;
  Lanes z;
  Lanes best = {0, 0, 0, 0};
  Mask match = {kBelowAll, kBelowAll, kBelowAll, kBelowAll};
  Mask is_maybe_above = {0, 0, 0, 0};
};

// One body for both instruction sets. Not contracted to FMA, so both round identically. Tests two
// blocks at a time, because loading a plane takes as long as testing a block; the last block may be
// tested twice.
__attribute__((always_inline)) inline bool MatchPlanesBody(
    std::span<const PointBlock* const> blocks, std::span<const PlaneWithLimits> planes,
    int64_t* matches) {
  Mask are_uncertain = {0, 0, 0, 0};
  for (size_t i = 0; i < blocks.size(); i += 2) {
    const size_t j = i + (i + 1 < blocks.size() ? 1 : 0);
    FourMatches first(*blocks[i]);
    FourMatches second(*blocks[j]);
    Mask index = {0, 0, 0, 0};
    for (const PlaneWithLimits& plane : planes) {
      first.Test(plane, index);
      second.Test(plane, index);
      index += 1;
    }
    first.Finish(matches + i * PointBlock::kSize, are_uncertain);
    second.Finish(matches + j * PointBlock::kSize, are_uncertain);
  }
  return (are_uncertain[0] | are_uncertain[1] | are_uncertain[2] | are_uncertain[3]) != 0;
}
static_assert(kUncertain == kBelowAll - 1);

bool MatchPlanesBaseline(std::span<const PointBlock* const> blocks,
                         std::span<const PlaneWithLimits> planes, int64_t* matches) {
  return MatchPlanesBody(blocks, planes, matches);
}

#ifdef HULLD_HAS_AVX2_PATH
__attribute__((target("avx2"))) bool MatchPlanesAvx2(std::span<const PointBlock* const> blocks,
                                                     std::span<const PlaneWithLimits> planes,
                                                     int64_t* matches) {
  return MatchPlanesBody(blocks, planes, matches);
}
#endif

// Finds the best point of each lane, then the best lane; the first one wins ties.
__attribute__((always_inline)) inline size_t FarthestAlongBody(std::span<const PointBlock> blocks,
                                                               size_t count,
                                                               const Vector& direction) {
  Lanes largest = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
  Mask farthest = {0, 1, 2, 3};
  Mask index = {0, 1, 2, 3};
  const auto end = static_cast<int64_t>(count);
  for (const PointBlock& block : blocks) {
    Lanes x;
    Lanes y;
    Lanes z;
    __builtin_memcpy(&x, block.x, sizeof(x));
    __builtin_memcpy(&y, block.y, sizeof(y));
    __builtin_memcpy(&z, block.z, sizeof(z));
    const Lanes value = direction.x() * x + direction.y() * y + direction.z() * z;
    const Mask is_better = (value > largest) & (index < end);
    largest = is_better ? value : largest;
    farthest = is_better ? index : farthest;
    index += static_cast<int64_t>(PointBlock::kSize);
  }
  size_t best = 0;
  for (size_t lane = 1; lane < PointBlock::kSize; ++lane) {
    const bool is_earlier = largest[lane] == largest[best] && farthest[lane] < farthest[best];
    if (largest[lane] > largest[best] || is_earlier) best = lane;
  }
  return static_cast<size_t>(farthest[best]);
}

#ifdef HULLD_HAS_AVX2_PATH
__attribute__((target("avx2"))) size_t FarthestAlongAvx2(std::span<const PointBlock> blocks,
                                                         size_t count, const Vector& direction) {
  return FarthestAlongBody(blocks, count, direction);
}
#endif

}  // namespace

bool MatchPlanes(std::span<const PointBlock* const> blocks, std::span<const PlaneWithLimits> planes,
                 int64_t* matches) {
#ifdef HULLD_HAS_AVX2_PATH
  if (UsesAvx2()) return MatchPlanesAvx2(blocks, planes, matches);
#endif
  return MatchPlanesBaseline(blocks, planes, matches);
}

size_t FarthestAlong(std::span<const PointBlock> blocks, size_t count, const Vector& direction) {
  HULLD_CHECK(count > 0 && BlocksFor(count) <= blocks.size());
#ifdef HULLD_HAS_AVX2_PATH
  if (UsesAvx2()) return FarthestAlongAvx2(blocks, count, direction);
#endif
  return FarthestAlongBody(blocks, count, direction);
}

}  // namespace hulld
