#ifndef HULLD_CORE_QUERY_TERMS_SEPARATION_BOUNDS_H_
#define HULLD_CORE_QUERY_TERMS_SEPARATION_BOUNDS_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>

#include "core/numeric/vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// The required accuracy of bounds on a length.
struct SeparationGoal {
  // Reached if half the width is at most absolute_error + relative_error * (size + length).
  double absolute_error = 0;
  double relative_error = 0;
  double size = 0;
  // Also reached if the bounds show the side of `threshold` on which the length lies. NaN: not
  // used.
  double threshold = std::numeric_limits<double>::quiet_NaN();

  bool Met(double low, double high) const {
    // Before any upper bound is known, both sides below would be infinite.
    if (!(high < std::numeric_limits<double>::infinity())) return low > threshold;
    const double middle = low + (high - low) / 2;
    return (high - low) / 2 <= absolute_error + relative_error * (size + middle) ||
           low > threshold || high < threshold;
  }
};

// A point of A - B as a convex combination of vertices, up to rounding.
struct FloatCombination {
  uint32_t count = 0;
  std::array<VertexPair, 3> pairs = {};
  std::array<double, 3> weights = {};
};

// Bounds, proven in floating point, on the distance of the origin from A - B, or from its boundary.
struct SeparationBounds {
  double low = 0;
  // A unit direction, up to rounding; zero if none is known. For distances: the direction along
  // which `low` is proven. For depths, if a point is requested: the outward normal n of the point's
  // facet of a polytope in A - B. All facets of it that may be within `high` of the origin lie at n
  // . p >= facet_low, up to the rounding of n . p.
  Vector direction = Vector::Zero();
  double facet_low = 0;
  double high = std::numeric_limits<double>::infinity();
  // The best point found that attains the distance; count 0 if unknown.
  FloatCombination point;
  // The length of that point as a vector, within kCombinationErrorFactor times the pair's size.
  double point_length = 0;
};

// Returns the largest power of two that is at most a positive size, or the least normal double:
// lengths divided by it are near 1.
inline double UnitOf(double size) {
  constexpr uint64_t kExponent = uint64_t{0x7ff} << 52;
  return std::bit_cast<double>(
      std::max(std::bit_cast<uint64_t>(size) & kExponent, uint64_t{1} << 52));
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_SEPARATION_BOUNDS_H_
