#ifndef HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_
#define HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/hull/hull.h"
#include "core/numeric/cube_map.h"
#include "core/numeric/vector.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/placed/support_blocks.h"

namespace hulld {

// Finds the points of a finite set that lie farthest along a direction.
//
// Few points are scanned, four at a time. For many the directions are divided into the cells of a
// cube map, each of which lists the points that may be the farthest along some direction in it. A
// point p is left out of a cell where another point q is at least as far along every direction of
// the cell, exactly: along the directions of a square on a face of the cube, n . (p - q) is largest
// at a corner, so that one evaluation with a proven bound shows it. Cells are filled from the whole
// face down, each from the list of the square that it is a part of. Cells with many points are
// divided further. Directions are first scaled by the extents of the set, so that the cells of an
// oblong set are filled evenly.
//
// The set need not be convex: points inside its hull are listed in few cells or in none, and flat
// sets are like any other. Squares are widened by kCellMargin, so that a list also holds every
// point that is farthest along a direction which differs from the one looked up by less.
//
// Values n . v are computed as (n.x v.x + n.y v.y) + n.z v.z, the same bits on any instruction set.
class SupportMap {
 public:
  // On a face of the cube, whose coordinates run from -1 to 1.
  static constexpr double kCellMargin = 0x1p-30;

  SupportMap() = default;
  // `points` must outlive the map. Cost: O(V log V), observed 0.3 to 1.1 us a point for 64 to
  // 1000000 points; O(V) for few.
  explicit SupportMap(std::span<const Vector> points);
  explicit SupportMap(const Hull& hull) : SupportMap(hull.vertices()) {}
  // The same answers at O(V) each, without any preparation.
  static SupportMap ForScanning(std::span<const Vector> points);

  using Support = SupportPoint;

  // A point farthest along n: its computed value is the largest of all but for the rounding of two
  // values. Requires points. Cost: O(V) where points are scanned, O(1) on average otherwise.
  Support Farthest(const PlainVector& n) const {
    HULLD_DCHECK(!points_.empty());
    return cells_.empty() ? Scan(n) : LookUp(n);
  }

  // Appends, ascending, points whose value is at least `least`, which is below the largest: among
  // them all that are exactly farthest along some direction whose components differ from those of n
  // by up to `error`, when `least` allows for what their values may err. `first` is added to each
  // index. Cost: O(V) where points are scanned or the error is too large for the cells.
  void AppendCandidates(const PlainVector& n, double error, double least, uint32_t first,
                        std::vector<uint32_t>& candidates) const;

  // The points that some cell lists, ascending: their hull is that of all. All, where points are
  // scanned.
  std::vector<uint32_t> Listed() const;

  bool scans() const { return cells_.empty(); }
  size_t MemoryBytes() const;

 private:
  // The points of a cell, repeated where there are fewer than four. Where there are more, three of
  // them, and ids[3] is kLong plus where in lists_ the others begin, after their number. Where the
  // cell is divided, ids[3] is kDivided plus where in cells_ its four quarters begin.
  struct Cell {
    uint32_t ids[4];
  };
  static constexpr uint32_t kLong = uint32_t{1} << 31;
  static constexpr uint32_t kDivided = uint32_t{3} << 30;
  class Filling;
  struct Place;

  void BuildBlocks();
  Support Scan(const PlainVector& n) const;
  const Cell& QuarterAt(const Cell& divided, const Place& place) const;
  // The other points of a cell that lists more than four.
  std::span<const uint32_t> OthersOf(const Cell& cell) const {
    const size_t at = cell.ids[3] - kLong;
    return std::span(lists_).subspan(at + 1, lists_[at]);
  }
  Support LookUp(const PlainVector& n) const;
  Support BestOfFour(const Cell& cell, const PlainVector& n) const;
  Support LookUpDeep(const Cell& cell, const Place& place, const PlainVector& n) const;
  double ValueOf(uint32_t vertex, const PlainVector& n) const {
    const Vector& v = points_[vertex];
    return SupportValue(n, v.x(), v.y(), v.z());
  }

  // Where a direction is among the cells: the face, and the coordinates there in cells.
  struct Place {
    uint32_t face;
    double s;
    double t;
  };
  Place PlaceOf(const PlainVector& n) const;
  const Cell& CellAt(const Place& place) const {
    return cells_[CubeCell(place.face, side_, static_cast<uint32_t>(static_cast<int32_t>(place.s)),
                           static_cast<uint32_t>(static_cast<int32_t>(place.t)))];
  }

  std::span<const Vector> points_;
  // Few points: all of them.
  std::vector<SupportBlock> blocks_;
  // Many points: the cube map, 6 x side x side, and the parts of cells that are divided.
  std::vector<Cell> cells_;
  std::vector<uint32_t> lists_;
  PlainVector scale_ = {1, 1, 1};
  uint32_t side_ = 0;
  // side_ / 2, and the largest double below side_.
  double half_ = 0;
  double below_side_ = 0;
};

// Zero and what overflows get some place, too.
inline SupportMap::Place SupportMap::PlaceOf(const PlainVector& n) const {
  const OnCube on_cube(n.x * scale_.x, n.y * scale_.y, n.z * scale_.z);
  const double factor = half_ / on_cube.largest();
  // Written so that NaN becomes a number.
  const auto place = [&](double component) {
    double x = component * factor + half_;
    x = x < below_side_ ? x : below_side_;
    return x > 0 ? x : 0;
  };
  return {on_cube.face(), place(on_cube.first()), place(on_cube.second())};
}

inline SupportMap::Support SupportMap::LookUp(const PlainVector& n) const {
  const Place place = PlaceOf(n);
  const Cell& cell = CellAt(place);
  return cell.ids[3] < kLong ? BestOfFour(cell, n) : LookUpDeep(cell, place, n);
}

inline SupportMap::Support SupportMap::BestOfFour(const Cell& cell, const PlainVector& n) const {
  const double v0 = ValueOf(cell.ids[0], n);
  const double v1 = ValueOf(cell.ids[1], n);
  const double v2 = ValueOf(cell.ids[2], n);
  const double v3 = ValueOf(cell.ids[3], n);
  const double low_value = std::max(v0, v1);
  const double high_value = std::max(v2, v3);
  // Arithmetic of truth values, as compilers turn conditions into branches.
  const uint32_t low = v1 > v0;
  const uint32_t high = 2 + (v3 > v2);
  const uint32_t is_high = high_value > low_value;
  const uint32_t best = (low & (is_high - 1)) | (high & -is_high);
  return {cell.ids[best], std::max(low_value, high_value)};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_
