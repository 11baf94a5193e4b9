#ifndef HULLD_CORE_HULL_GROWTH_DIRECTION_MAP_H_
#define HULLD_CORE_HULL_GROWTH_DIRECTION_MAP_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/numeric/cube_map.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"

namespace hulld {

// A cube map of directions round a point c strictly inside a growing convex set: 6 faces of n x n
// cells. Each cell holds a radius below which every point in its directions is certainly inside,
// and a hint where on the surface its directions lead. The set only grows, so what the map holds
// stays true.
//
// Idea: measured by the largest absolute component m of p - c, the gauge of a convex set is convex
// on a face of the cube, so its maximum over a cell is at a corner: points of the set found along
// the four corner directions bound the whole cell.
class DirectionMap {
 public:
  // Where a point lies: its cell, and its distance m from c.
  struct Place {
    size_t cell;
    double distance;
  };

  // One cell a face, and nothing is certainly inside.
  explicit DirectionMap(const Vector& center);
  // No cells yet: they are appended, so that a map can be made little by little.
  DirectionMap(const Vector& center, int resolution);
  // Appends the next cell, face by face, i major. reach: the least, over the cell's corners, of a
  // distance m such that the double nearest to center + m * direction, component by component, is
  // in the set. Cost: O(1).
  void AppendCell(double reach, uint32_t hint);
  // Says what the least and the largest reach of all corners are. Requires that all cells are
  // there. Where the shape is too slender for the rounding of this map to be negligible, nothing is
  // certainly inside.
  void Finish(double least_reach, double largest_reach);

  const Vector& center() const { return center_; }
  int resolution() const { return n_; }
  size_t cell_count() const { return 6 * static_cast<size_t>(n_) * static_cast<size_t>(n_); }

  // NaN-free for every finite point. The cell may be a neighbour of the true one by rounding; the
  // radii allow for that.
  Place PlaceOf(const Vector& point) const { return PlaceIn(center_, n_, point); }
  // The same for a map of any resolution.
  static Place PlaceIn(const Vector& center, int resolution, const Vector& point) {
    const Vector v = point - center;
    const OnCube on_cube(v.x(), v.y(), v.z());
    const double m = on_cube.largest();
    if (m == 0) return {0, 0};
    if (!(m >= kMapMinDistance && m <= kMapMaxDistance)) return {0, INFINITY};
    const double half = 0.5 * resolution;
    const double scale = half / m;
    const int i = std::min(resolution - 1, static_cast<int>(on_cube.first() * scale + half));
    const int j = std::min(resolution - 1, static_cast<int>(on_cube.second() * scale + half));
    const auto side = static_cast<uint32_t>(resolution);
    return {CubeCell(on_cube.face(), side, static_cast<uint32_t>(i), static_cast<uint32_t>(j)), m};
  }
  bool IsCertainlyInside(const Place& place) const {
    return rejects_ && place.distance < radii_[place.cell];
  }

  uint32_t hint(size_t cell) const { return hints_[cell]; }
  void SetHint(size_t cell, uint32_t hint) { hints_[cell] = hint; }

  // The direction of corner (i, j), 0 <= i, j <= resolution(), of a face: its largest component is
  // +-1.
  Vector CornerDirection(int face, int i, int j) const;
  // Halves the resolution where that is possible: fewer cells, each as near as its nearest part.
  void Coarsen();
  size_t MemoryBytes() const {
    return radii_.capacity() * sizeof(double) + hints_.capacity() * sizeof(uint32_t);
  }

  // Appends the indices of the points that are not certainly inside, ascending.
  void AppendSurvivors(std::span<const Vector> points, std::vector<uint32_t>& survivors) const;

 private:
  void AppendSurvivorsBaseline(std::span<const Vector> points, size_t from,
                               std::vector<uint32_t>& survivors) const;
  size_t AppendSurvivorsAvx2(std::span<const Vector> points,
                             std::vector<uint32_t>& survivors) const;

  Vector center_;
  int n_;
  double half_;
  bool rejects_ = false;
  std::vector<double> radii_;
  std::vector<uint32_t> hints_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_DIRECTION_MAP_H_
