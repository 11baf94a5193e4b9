#ifndef HULLD_CORE_QUERY_CENTER_BOUNDS_H_
#define HULLD_CORE_QUERY_CENTER_BOUNDS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/plain_vector.h"
#include "core/query/support_map.h"

namespace hulld {

// How far a hull reaches as seen from its centre c, bounded from above and from below for every
// direction, without a look at its vertices.
//
// From above, the support function h(n): the largest n . (v - c). From below, the gauge g(d): the
// least g with c + d / g in the hull. Both are convex and grow in proportion to their argument, so
// that a value between others is at most their interpolation. They are kept at the corners of the
// cells of a cube map; on a face of the cube a direction is the bilinear mean of the corners of its
// cell, and the same mean of their values bounds its own. Where the hull is round, what is lost
// shrinks with the square of a cell's width.
class CenterBounds {
 public:
  // None: every bound is unknown.
  CenterBounds() = default;
  // None for a hull that is flat. The gauge is unknown unless c is certain to be strictly inside.
  // Cost: O(C F) for C corners, which are O(V) and at most 6 x 81, and F facets.
  CenterBounds(const Hull& hull, const SupportMap& support);

  // Not a number where unknown.
  struct Bounds {
    double support = std::numeric_limits<double>::quiet_NaN();
    double gauge = std::numeric_limits<double>::quiet_NaN();
  };
  // Upper bounds of h(n) and g(n), but for errors of the hull's coordinates and of n (see
  // kCenterSupportFactor and kCenterGaugeFactor in core/numeric/error_bounds.h). Requires the
  // largest component of n positive, and n in the range of FloatPair's directions.
  Bounds Along(const PlainVector& n) const;
  // At least g(d) for all d with components of at most 1; infinite where unknown.
  double largest_gauge() const { return largest_gauge_; }

  size_t MemoryBytes() const { return corners_.capacity() * sizeof(Corner); }

 private:
  // Of directions whose largest component is 1: the support function in units, the gauge per unit.
  struct Corner {
    float support;
    float gauge;
  };

  void AddSupports(const Hull& hull, const SupportMap& support, double radius);
  void AddGauges(const Hull& hull);
  Vector DirectionOf(uint32_t corner) const;

  // (side_ + 1)^2 corners for each of the six faces.
  std::vector<Corner> corners_;
  uint32_t side_ = 0;
  double half_ = 0;
  // A power of two near the hull's radius.
  double unit_ = 1;
  double per_unit_ = 1;
  double largest_gauge_ = std::numeric_limits<double>::infinity();
};

inline CenterBounds::Bounds CenterBounds::Along(const PlainVector& n) const {
  if (corners_.empty()) return {};
  const double components[5] = {n.x, n.y, n.z, n.x, n.y};
  const double x = std::abs(n.x);
  const double y = std::abs(n.y);
  const double z = std::abs(n.z);
  const double larger = std::max(x, y);
  const double largest = std::max(larger, z);
  const double factor = half_ / largest;
  // Arithmetic of truth values, as compilers turn conditions into branches.
  const uint32_t is_y = y > x;
  const uint32_t is_z = z > larger;
  const uint32_t axis = (is_y & (is_z - 1)) | (2 * is_z);
  const uint32_t face = 2 * axis + static_cast<uint32_t>(std::signbit(components[axis]));
  const double u = components[axis + 1] * factor + half_;
  const double v = components[axis + 2] * factor + half_;
  const uint32_t last = side_ - 1;
  const uint32_t i = std::min(static_cast<uint32_t>(static_cast<int32_t>(u)), last);
  const uint32_t j = std::min(static_cast<uint32_t>(static_cast<int32_t>(v)), last);
  const uint32_t row = side_ + 1;
  const Corner* const low = corners_.data() + (face * row + i) * row + j;
  const Corner* const high = low + row;
  // The weights are not negative: u and v may exceed side_ by rounding, or be below 0.
  const double s = std::clamp(u - i, 0.0, 1.0);
  const double t = std::clamp(v - j, 0.0, 1.0);
  const auto mean = [&](float a, float b, float c, float d) {
    return (1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * c + t * d);
  };
  return {
      mean(low[0].support, low[1].support, high[0].support, high[1].support) * (largest * unit_),
      mean(low[0].gauge, low[1].gauge, high[0].gauge, high[1].gauge) * (largest * per_unit_)};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_CENTER_BOUNDS_H_
