#ifndef HULLD_CORE_QUERY_PLACED_HULL_BASE_H_
#define HULLD_CORE_QUERY_PLACED_HULL_BASE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/placed/center_bounds.h"
#include "core/query/placed/support_map.h"

namespace hulld {

// Returns an upper bound on the length of a computed difference of two points. Nearly tight, except
// for differences so small or so large that their squares are not doubles.
double RadiusTo(const Vector& difference);

// Points and their support map.
struct MappedPoints {
  explicit MappedPoints(std::vector<Vector> all) : points(std::move(all)), support(points) {}
  MappedPoints(MappedPoints&&) = default;  // the map refers to the elements, which stay in place
  MappedPoints& operator=(MappedPoints&&) = delete;

  std::vector<Vector> points;
  SupportMap support;
};

// A point set that generates the queried hull, and the data that queries need. Immutable.
class HullBase {
 public:
  // Takes the vertices of a canonical snapshot, which must outlive the base. The result is
  // prepared. should_stop: as for SupportMap; the base is not usable if its support map has
  // stopped().
  HullBase(const Hull& hull, const std::function<bool()>& should_stop);
  // Takes one or more points with a hull of this dimension. The result is prepared.
  HullBase(MappedPoints mapped, int dimension);
  // Takes points for scanning: computes only the data that scanning queries need. Cost: O(V),
  // comparisons and distances.
  HullBase(std::vector<Vector> points, int dimension);
  HullBase(const HullBase&) = delete;
  HullBase& operator=(const HullBase&) = delete;

  std::span<const Vector> points() const { return points_; }
  const SupportMap& support() const { return support_; }
  // Bounds about center(). None if the base is built for scanning.
  const CenterBounds& center_bounds() const { return center_bounds_; }
  bool prepared() const { return prepared_; }
  // The mean of the points extreme along the axes: a point in the hull where searches start.
  const Vector& center() const { return center_; }
  // Every point is within this distance of center(); rounded up.
  double radius() const { return radius_; }
  double max_abs_coordinate() const { return max_abs_; }
  // Every non-zero coordinate is a multiple of 2^exponent; kAboveAllExponents if all are zero.
  int exponent() const { return exponent_; }
  // Points that span the hull: one more than its dimension, affinely independent.
  std::span<const uint32_t> spanning() const { return std::span(spanning_).first(spanning_count_); }
  // Points, with repetitions: the axis extremes, and the points that span the hull. Their mean is
  // in the relative interior of the hull, and not near its boundary unless the hull is flat or a
  // needle.
  std::span<const uint32_t> inner() const { return std::span(inner_).first(inner_count_); }

  // Memory beyond that of a canonical snapshot, in bytes.
  size_t MemoryBytes() const {
    return sizeof(*this) + own_.capacity() * sizeof(Vector) + support_.MemoryBytes() +
           center_bounds_.MemoryBytes();
  }

 private:
  void Measure();
  void Span(int dimension);
  template <typename Size, typename IsOff>
  void SpanWith(Size size, IsOff is_off);

  std::vector<Vector> own_;
  std::span<const Vector> points_;
  bool prepared_;
  Vector center_ = Vector::Zero();
  double radius_ = 0;
  double max_abs_ = 0;
  int exponent_ = 0;
  std::array<uint32_t, 4> spanning_ = {};
  uint32_t spanning_count_ = 0;
  std::array<uint32_t, 10> inner_ = {};
  uint32_t inner_count_ = 0;
  SupportMap support_;
  CenterBounds center_bounds_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_HULL_BASE_H_
