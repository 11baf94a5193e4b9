#ifndef HULLD_CORE_HULL_SURFACE_DIRECTION_MAP_H_
#define HULLD_CORE_HULL_SURFACE_DIRECTION_MAP_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/numeric/cube_map.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"

namespace hulld {

// The coordinates in which a map measures a set: q = L (p - center), L a lower triangular matrix,
// rounded to floats. L scales the set to a size near 1. For a set that is flat or slender in any
// direction, L also makes it about equally wide in all directions, so that the cells of a map
// divide its surface evenly. L is exactly the matrix of its doubles, so its rounding is irrelevant.
class MapFrame {
 public:
  // L is 1 / size, rounded to a power of two. size: largest distance of the set from the center,
  // by components.
  MapFrame(const Vector& center, double size);
  // Builds the frame that maps points with these second moments about `center`, the sums of the
  // products of their differences, to points equally spread in all directions, times a factor; |L|
  // is at most about 1 / size, component by component. L is as without moments if the points are
  // already nearly so spread, if they are so flat that rounding would matter, or if the moments are
  // not finite. `moments` may be multiplied by any factor.
  MapFrame(const Vector& center, double size, const Eigen::Matrix3d& moments);

  const Vector& center() const { return center_; }
  bool is_plain() const { return is_plain_; }
  Eigen::Matrix3d matrix() const;
  // Returns L (p - center), rounded. An overflow yields an infinite or NaN component.
  Eigen::Vector3f ToMap(const Vector& point) const {
    const Vector v = point - center_;
    const auto& [xx, yx, yy, zx, zy, zz] = entries_;
    if (is_plain_) return (xx * v).cast<float>();
    return Vector(xx * v.x(), yx * v.x() + yy * v.y(), (zx * v.x() + zy * v.y()) + zz * v.z())
        .cast<float>();
  }
  // Returns the difference of points that L maps to `direction`, rounded.
  Vector FromMap(const Vector& direction) const;

 private:
  Vector center_;
  // The entries of L, row by row up to the diagonal.
  std::array<double, 6> entries_;
  // True if L is a multiple of the identity.
  bool is_plain_ = true;
};

// A cube map of directions around a point c strictly inside a growing convex set: 6 faces of n x n
// cells. Each corner of a cell stores a bound on the set's gauge in its direction, and each cell
// stores a hint of the place on the surface to which its directions lead. The set only grows, so
// the map stays valid.
//
// The gauge of a convex set, the factor by which the set about c must be scaled to reach a point,
// is convex along any line. A point's direction, scaled to the largest absolute component 1, lies
// in a cell on a face of the cube; the gauge there is at most the bilinear interpolation of the
// values at the cell's four corners. A few points of the set, found along the corners' directions,
// therefore reject all points below a surface that follows planes exactly and curves closely, even
// if points lie along the surface. Linear maps of the set preserve this, so all computations are in
// the coordinates of a frame.
class DirectionMap {
 public:
  // The location of a point: its cell, the index of the cell's first corner, the position in the
  // cell along both sides, from 0 to 1, and the distance m from c, the largest absolute component
  // in the frame.
  struct Place {
    size_t cell;
    size_t corner;
    float along_first;
    float along_second;
    float distance;
  };

  // One cell per face; no point is certainly inside.
  explicit DirectionMap(const MapFrame& frame);
  // Starts without corners and cells. They are appended, so that a map can be built incrementally.
  DirectionMap(const MapFrame& frame, int resolution);
  // Appends the next corner, face by face, i major. reach: a distance m such that the double
  // nearest to center + m * direction, component by component, is in the set.
  void AppendCorner(double reach);
  // Appends the next cell, in the same order.
  void AppendCell(uint32_t hint);
  // Completes the map with the least and the largest reach of all corners, and a bound, by
  // components, of the set's extent from the center. If the shape is too slender for the rounding
  // of this map to be negligible, no point is certainly inside. Requires: all corners and cells
  // have been appended.
  void Finish(double min_reach, double largest_reach, double extent);

  const MapFrame& frame() const { return frame_; }
  const Vector& center() const { return frame_.center(); }
  int resolution() const { return n_; }
  size_t cell_count() const { return 6 * static_cast<size_t>(n_) * static_cast<size_t>(n_); }

  // NaN-free for every finite point. By rounding, the cell may be a neighbor of the true one; the
  // gauges allow for that.
  Place PlaceOf(const Vector& point) const { return PlaceIn(frame_, n_, point); }
  // PlaceOf for a map of any resolution.
  static Place PlaceIn(const MapFrame& frame, int resolution, const Vector& point) {
    const Eigen::Vector3f v = frame.ToMap(point);
    const OnCube on_cube(v.x(), v.y(), v.z());
    const float m = on_cube.largest();
    if (!(m >= kMapMinDistance && m <= kMapMaxDistance)) return {0, 0, 0, 0, INFINITY};
    const auto side = static_cast<float>(resolution);
    const float half = 0.5f * side;
    const float scale = half / m;
    const float first = std::max(0.0f, std::min(side, on_cube.first() * scale + half));
    const float second = std::max(0.0f, std::min(side, on_cube.second() * scale + half));
    const int i = std::min(resolution - 1, static_cast<int>(first));
    const int j = std::min(resolution - 1, static_cast<int>(second));
    const auto row = static_cast<uint32_t>(i);
    const auto column = static_cast<uint32_t>(j);
    const auto cells = static_cast<uint32_t>(resolution);
    return {CubeCell(on_cube.face(), cells, row, column),
            CubeCell(on_cube.face(), cells + 1, row, column), first - static_cast<float>(i),
            second - static_cast<float>(j), m};
  }
  bool IsCertainlyInside(const Place& place) const {
    return place.distance * GaugeAt(place) < limit_;
  }

  uint32_t hint(size_t cell) const { return hints_[cell]; }
  void SetHint(size_t cell, uint32_t hint) { hints_[cell] = hint; }

  // Returns the direction of corner (i, j), 0 <= i, j <= resolution(), of a face: its largest
  // component in the frame is +-1.
  Vector CornerDirection(int face, int i, int j) const;
  // Halves the resolution, keeping one of four corners. Returns false, and changes nothing, if it
  // is odd.
  bool Coarsen();
  size_t MemoryBytes() const {
    return gauges_.capacity() * sizeof(float) + hints_.capacity() * sizeof(uint32_t);
  }

  // Appends the indices of the points that are not certainly inside, ascending. If the poll stops,
  // some points are skipped.
  void AppendSurvivors(std::span<const Vector> points, std::vector<uint32_t>& survivors,
                       StopPoll& poll) const;

 private:
  size_t corner_count() const {
    return 6 * (static_cast<size_t>(n_) + 1) * (static_cast<size_t>(n_) + 1);
  }
  float GaugeAt(const Place& place) const {
    const float* const low = gauges_.data() + place.corner;
    const float* const high = low + n_ + 1;
    const float s = place.along_first;
    const float t = place.along_second;
    return (low[0] * (1 - t) + low[1] * t) * (1 - s) + (high[0] * (1 - t) + high[1] * t) * s;
  }
  size_t WriteSurvivorsAvx2(std::span<const Vector> points, uint32_t*& end) const;

  MapFrame frame_;
  int n_;
  double half_;
  // A point is inside if its distance times its gauge, in floats, is below this. 0: rounding could
  // matter.
  float limit_ = 0;
  // By corner: the gauge of its direction.
  std::vector<float> gauges_;
  std::vector<uint32_t> hints_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_DIRECTION_MAP_H_
