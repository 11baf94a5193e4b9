#ifndef HULLD_CORE_QUERY_PLACED_CENTER_BOUNDS_H_
#define HULLD_CORE_QUERY_PLACED_CENTER_BOUNDS_H_

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/hull/hull.h"
#include "core/numeric/cube_map.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/placed/support_map.h"

namespace hulld {

// Upper and lower bounds on a hull's extent as seen from its center c, for every direction, without
// access to its vertices.
//
// The upper bound is the support function h(n): the largest n . (v - c). The lower bound is the
// gauge g(d): the least g with c + d / g in the hull. Both are convex and positively homogeneous,
// so interpolation between known values gives an upper bound. The values are stored at the corners
// of the cells of a cube map. On a face of the cube, a direction is the bilinear mean of the
// corners of its cell, and the same mean of their values bounds its value. For a round hull, the
// loss shrinks with the square of the cell width.
//
// A cell is computed when the first direction, or the second, leads into it (Making), because most
// hulls are viewed from few sides. Its content does not depend on the time of computation.
// Thread-safe.
class CenterBounds {
 public:
  // Time at which a cell is computed. kAtFirstUse: answers do not depend on earlier queries.
  // kAtSecondUse: a hull with few queries costs less, because a cell costs as much as several
  // queries; the bounds of the cell are unknown until then.
  enum class Making { kAtFirstUse, kAtSecondUse };

  // Has no bounds: every bound is unknown.
  CenterBounds() = default;
  // Bounds for the hull of the points about a center. A flat hull (`dimension` below 3) has none.
  // The gauge is unknown unless the center is certainly strictly inside. max_abs: the largest
  // absolute coordinate of the points. The points and the support map must outlive the bounds and
  // must not move. Cost: O(V) comparisons; the first computed cell takes about 100 more support
  // points, and each of 24 or 384 cells about 25.
  CenterBounds(std::span<const Vector> points, int dimension, const Vector& center, double max_abs,
               const SupportMap& support, Making making);
  CenterBounds(const Hull& hull, const SupportMap& support)
      : CenterBounds(hull.vertices(), hull.dimension(), hull.center(), hull.max_abs_coordinate(),
                     support, Making::kAtFirstUse) {}

  // NaN if unknown.
  struct Bounds {
    double support = std::numeric_limits<double>::quiet_NaN();
    double gauge = std::numeric_limits<double>::quiet_NaN();
  };
  // The location of a direction among the corners; unknown if there are no corners.
  class Place;
  // Locates n, and counts as a look at its cell (see Making). Requires: n in the range of
  // FloatPair's directions (IsFilterDirection).
  Place PlaceOf(const PlainVector& n) const;
  // Returns upper bounds on h(n) and g(n) for the n of a place, up to errors of the hull's
  // coordinates and of n (see kCenterSupportFactor and kCenterGaugeFactor in
  // core/numeric/error_bounds.h).
  Bounds At(const Place& place) const;
  Bounds Along(const PlainVector& n) const;
  // Returns the approximate outward normal of the hull at the point where the ray from c along the
  // n of a place leaves it; longer where the hull is narrow. Zero if coarse or unknown.
  PlainVector NormalAt(const Place& place) const;
  // True if there are few corners or none. The bounds then help only for points deep inside, and
  // the normals are useless.
  bool coarse() const { return side_ < kMinFineSide; }
  // At least g(d) for all d with components of at most 1; infinite if unknown. Requires: this
  // thread has obtained a known place.
  double largest_gauge() const {
    HULLD_DCHECK(map_ != nullptr);
    return map_->largest_gauge;
  }

  // Memory in bytes, with all cells.
  size_t MemoryBytes() const {
    return map_ == nullptr ? 0 : sizeof(Map) + corner_count() * sizeof(Corner);
  }

 private:
  // Cells along a side of a face. Observed: guessing a normal from fewer does not pay off.
  static constexpr uint32_t kMinFineSide = 4;
  // Values for directions with largest component 1: the support function in units, and the gauge
  // per unit.
  struct Corner {
    float support;
    float gauge;
  };

  // The data from which cells are computed, and the computed cells.
  struct Map {
    std::span<const Vector> points;
    Vector center;
    double radius;
    double max_abs;
    const SupportMap* support;

    // By face, one bit for each cell, by rows: set if its corners have been computed. A thread that
    // sees a bit set may read these corners, and the largest gauge.
    std::array<std::atomic<uint64_t>, 6> cells = {};
    // In the same layout: set if the next look computes the cell.
    std::array<std::atomic<uint64_t>, 6> awaited = {};
    // Held while a thread computes a cell.
    std::mutex mutex;
    // (side + 1)^2 for each of the six faces; empty before the first cell is computed.
    std::vector<Corner> corners;
    double largest_gauge = kInfinity;
    // 1 over the hull's width along each axis.
    Vector per_width;
  };

  size_t corner_count() const { return size_t{6} * (side_ + 1) * (side_ + 1); }
  // Returns true if the cell has been computed, before or by this call.
  bool LookAtCell(uint32_t face, uint32_t i, uint32_t j) const {
    const uint64_t bit = uint64_t{1} << (i * side_ + j);
    if ((map_->cells[face].load(std::memory_order_acquire) & bit) != 0) [[likely]]
      return true;
    if ((map_->awaited[face].fetch_or(bit, std::memory_order_relaxed) & bit) == 0) return false;
    MakeCell(face, i, j);
    return true;
  }
  void MakeCell(uint32_t face, uint32_t i, uint32_t j) const;
  void Begin() const;
  void MakeSupport(uint32_t corner) const;
  float MakeGauge(uint32_t corner) const;
  float MeanGauge(uint32_t corner, uint32_t down, uint32_t right) const;

  // Null if there are no bounds.
  std::unique_ptr<Map> map_;
  uint32_t side_ = 0;
  double half_ = 0;
  // A power of two near the hull's radius.
  double unit_ = 1;
  double per_unit_ = 1;
};

class CenterBounds::Place {
 public:
  // True if the place has bounds.
  bool known() const { return low_ != nullptr; }

 private:
  friend class CenterBounds;
  double largest_ = 0;     // component of n
  uint32_t axis_ = 0;      // of that component
  bool negative_ = false;  // its sign
  // The other components over the largest, in cells.
  double across_s_ = 0;
  double across_t_ = 0;
  double s_ = 0;  // from low_[0] to high_[0]
  double t_ = 0;  // from low_[0] to low_[1]
  const Corner* low_ = nullptr;
  const Corner* high_ = nullptr;
};

inline CenterBounds::Place CenterBounds::PlaceOf(const PlainVector& n) const {
  Place place;
  if (map_ == nullptr) return place;
  const OnCube on_cube(n.x, n.y, n.z);
  // Rotation into a hull's frame changes the largest component by a factor of at most sqrt(3).
  HULLD_DCHECK(IsFilterDirection(2 * on_cube.largest()) ||
               IsFilterDirection(on_cube.largest() / 2));
  place.largest_ = on_cube.largest();
  const double factor = half_ / place.largest_;
  place.axis_ = on_cube.axis();
  place.negative_ = on_cube.negative();
  place.across_s_ = on_cube.first() * factor;
  place.across_t_ = on_cube.second() * factor;
  const double u = place.across_s_ + half_;
  const double v = place.across_t_ + half_;
  const uint32_t last = side_ - 1;
  const uint32_t i = std::min(static_cast<uint32_t>(static_cast<int32_t>(u)), last);
  const uint32_t j = std::min(static_cast<uint32_t>(static_cast<int32_t>(v)), last);
  const uint32_t row = side_ + 1;
  const uint32_t face = CubeFace(place.axis_, place.negative_);
  if (!LookAtCell(face, i, j)) return place;
  place.low_ = map_->corners.data() + CubeCell(face, row, i, j);
  place.high_ = place.low_ + row;
  // Keeps the weights non-negative: by rounding, u and v may exceed side_ or be below 0.
  place.s_ = std::clamp(u - i, 0.0, 1.0);
  place.t_ = std::clamp(v - j, 0.0, 1.0);
  return place;
}

inline CenterBounds::Bounds CenterBounds::At(const Place& place) const {
  if (!place.known()) return {};
  const double s = place.s_;
  const double t = place.t_;
  const auto mean = [&](float a, float b, float c, float d) {
    return (1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * c + t * d);
  };
  const Corner* const low = place.low_;
  const Corner* const high = place.high_;
  return {mean(low[0].support, low[1].support, high[0].support, high[1].support) *
              (place.largest_ * unit_),
          mean(low[0].gauge, low[1].gauge, high[0].gauge, high[1].gauge) *
              (place.largest_ * per_unit_)};
}

inline CenterBounds::Bounds CenterBounds::Along(const PlainVector& n) const {
  return At(PlaceOf(n));
}

// Computes the gradient of the gauge per unit. On a face, the gauge is the largest component times
// a function of the ratios of the other components to it.
inline PlainVector CenterBounds::NormalAt(const Place& place) const {
  if (!place.known() || coarse() || !(largest_gauge() < kInfinity)) return {0, 0, 0};
  const double corner = place.low_[0].gauge;
  const double along_low = place.low_[1].gauge - corner;
  const double along_high = double{place.high_[1].gauge} - place.high_[0].gauge;
  const double twist = along_high - along_low;
  const double slope_s = place.high_[0].gauge - corner + place.t_ * twist;
  const double slope_t = along_low + place.s_ * twist;
  const double value = corner + place.t_ * along_low + place.s_ * slope_s;
  const double slope = value - (place.across_s_ * slope_s + place.across_t_ * slope_t);
  // The component along the axis is followed by the next two, cyclically.
  double normal[5];
  normal[place.axis_] = place.negative_ ? -slope : slope;
  normal[place.axis_ + 1] = half_ * slope_s;
  normal[place.axis_ + 2] = half_ * slope_t;
  return {place.axis_ == 0 ? normal[0] : normal[3], place.axis_ == 2 ? normal[4] : normal[1],
          normal[2]};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_CENTER_BOUNDS_H_
