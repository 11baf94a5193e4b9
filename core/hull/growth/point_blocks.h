#ifndef HULLD_CORE_HULL_GROWTH_POINT_BLOCKS_H_
#define HULLD_CORE_HULL_GROWTH_POINT_BLOCKS_H_

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/numeric/vector.h"

namespace hulld {

// Four points as a structure of arrays, to be tested against planes together.
struct PointBlock {
  static constexpr size_t kSize = 4;

  double x[kSize];
  double y[kSize];
  double z[kSize];

  Vector point(size_t i) const { return {x[i], y[i], z[i]}; }
  void Set(size_t i, const Vector& p) {
    x[i] = p.x();
    y[i] = p.y();
    z[i] = p.z();
  }
  // Copies component by component: compilers copy a whole object with a string instruction, which
  // takes longer to start than this entire function.
  void Fill(const Vector& p) {
    for (size_t i = 0; i < kSize; ++i) Set(i, p);
  }
};

inline size_t BlocksFor(size_t points) {
  return (points + PointBlock::kSize - 1) / PointBlock::kSize;
}

// A plane in floating point: points with normal . p > above are certainly above it, points with
// normal . p < below are certainly below. Infinite limits leave all points uncertain.
struct PlaneWithLimits {
  double normal[3];
  double above;
  double below;
};

inline bool IsCertainlyBelow(const PlaneWithLimits& plane, const Vector& p) {
  return plane.normal[0] * p.x() + plane.normal[1] * p.y() + plane.normal[2] * p.z() < plane.below;
}

// Results of MatchPlanes for a point that is certainly above no plane: certainly below all, or
// uncertain.
inline constexpr int64_t kBelowAll = -1;
inline constexpr int64_t kUncertain = -2;

// Finds, for each point of the blocks, the plane with the largest normal . p - above among the
// planes that the point is certainly above; kBelowAll or kUncertain if there is none. matches:
// indices of planes, 4 per block. Returns true if some points are uncertain. Bit-identical with and
// without AVX2.
bool MatchPlanes(std::span<const PointBlock* const> blocks, std::span<const PlaneWithLimits> planes,
                 int64_t* matches);

// Returns the index of the point, among the first `count`, with the largest component along the
// direction. Requires: count > 0.
size_t FarthestAlong(std::span<const PointBlock> blocks, size_t count, const Vector& direction);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_POINT_BLOCKS_H_
