#ifndef HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_
#define HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/hull/hull.h"
#include "core/numeric/cube_map.h"
#include "core/numeric/vector.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/placed/support_blocks.h"
#include "core/query/placed/support_tree.h"

namespace hulld {

// Finds the points of a finite set that lie farthest along a direction.
//
// Small sets are scanned, four points per step. For large sets, the directions are divided into the
// cells of a cube map, and each cell lists the points that may be farthest along some direction in
// it. A point p is omitted from a cell if another point q is at least as far along every direction
// of the cell, exactly: over the directions of a square on a face of the cube, n . (p - q) is
// largest at a corner, so one evaluation with a proven bound shows it. Cells are filled top-down
// from the whole face, each from the list of its enclosing square. Cells with many points are
// divided further. Directions are first scaled by the extents of the set, so that the cells of an
// oblong set are filled evenly.
//
// For points along a curve, as in a polygon, a prism or a cone, each cell may list many points
// however small it is: all lists together would take about V^1.5. A square is therefore left
// without a list if its parts would list points too often; a tree of boxes (SupportTree) then
// answers directions in that square.
//
// The set need not be convex: points inside its hull are listed in few cells or in none, and flat
// sets need no special case. Squares are widened by kCellMargin, so that a list also contains every
// point that is farthest along a direction that differs from the query by less than that.
//
// Values n . v are computed as (n.x v.x + n.y v.y) + n.z v.z, the same bits on any instruction set.
class SupportMap {
 public:
  // In face coordinates, which range from -1 to 1.
  static constexpr double kCellMargin = 0x1p-30;

  SupportMap() = default;
  // `points` must outlive the map. Cost: O(V log V) time and O(V) memory for every set; O(V) time
  // for small sets. **Observed** 0.3 to 1.1 us per point for 64 to 1000000 points of round shapes.
  // should_stop, which may be empty, is polled every few milliseconds; after it returns true, the
  // map is stopped() and not usable.
  explicit SupportMap(std::span<const Vector> points,
                      const std::function<bool()>& should_stop = {});
  explicit SupportMap(const Hull& hull) : SupportMap(hull.vertices()) {}
  // Builds a map that returns the same answers at O(V) each, without preparation.
  static SupportMap ForScanning(std::span<const Vector> points);

  using Support = SupportPoint;

  // Returns a point farthest along n: its computed value is the maximum, up to the rounding of two
  // values. Requires: at least one point. Cost: O(V) if points are scanned, otherwise O(1) on
  // average; that of a SupportTree for cells without lists.
  Support Farthest(const PlainVector& n) const {
    HULLD_DCHECK(!points_.empty());
    return cells_.empty() ? Scan(n) : LookUp(n);
  }

  // Appends, ascending, points with a value of at least `least`, which is below the maximum. They
  // include all points that are exactly farthest along some direction with components that differ
  // from n's by up to `error`, provided that `least` allows for the errors of their values. Adds
  // `first` to each index. Cost: O(V) if points are scanned or the error is too large for the
  // cells.
  void AppendCandidates(const PlainVector& n, double error, double least, uint32_t first,
                        std::vector<uint32_t>& candidates) const;

  // Returns the points listed in at least one cell, ascending; their hull is that of all points.
  // Returns all points if points are scanned.
  std::vector<uint32_t> Listed() const;

  bool stopped() const { return stopped_; }
  bool scans() const { return cells_.empty(); }
  // All points of a small set, with the last one repeated to fill the last block; otherwise empty.
  std::span<const SupportBlock> blocks() const { return blocks_; }
  size_t MemoryBytes() const;

 private:
  // Up to four points of a cell, repeated to fill four entries. With more points, three of them,
  // and ids[3] is kLong plus the offset in lists_ of the count and the remaining points. If the
  // cell is divided, ids[3] is kDivided plus the offset in cells_ of its four quarters. If the cell
  // has no list, ids[3] is kNoList, and tree_ is searched.
  struct Cell {
    uint32_t ids[4];
  };
  static constexpr uint32_t kLong = uint32_t{1} << 31;
  static constexpr uint32_t kDivided = uint32_t{3} << 30;
  static constexpr uint32_t kNoList = kDivided - 1;
  class Filling;
  struct Place;

  void BuildBlocks();
  Support Scan(const PlainVector& n) const;
  const Cell& QuarterAt(const Cell& divided, const Place& place) const;
  // Returns the remaining points of a cell that lists more than four.
  std::span<const uint32_t> RemainingOf(const Cell& cell) const {
    const size_t at = cell.ids[3] - kLong;
    return std::span(lists_).subspan(at + 1, lists_[at]);
  }
  Support LookUp(const PlainVector& n) const;
  Support BestOfFour(const Cell& cell, const PlainVector& n) const;
  Support LookUpDeep(const Cell& cell, const Place& place, const PlainVector& n) const;
  void AppendFromTree(const PlainVector& n, double least, uint32_t first,
                      std::vector<uint32_t>& candidates) const;
  double ValueOf(uint32_t vertex, const PlainVector& n) const {
    const Vector& v = points_[vertex];
    return SupportValue(n, v.x(), v.y(), v.z());
  }

  // The location of a direction among the cells: the face, and the coordinates there in cells.
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
  bool stopped_ = false;
  // Small sets: all points.
  std::vector<SupportBlock> blocks_;
  // Large sets: the cube map, 6 x side x side, and the parts of divided cells.
  std::vector<Cell> cells_;
  std::vector<uint32_t> lists_;
  // Tree of all points; empty if every cell has a list.
  SupportTree tree_;
  PlainVector scale_ = {1, 1, 1};
  uint32_t side_ = 0;
  // side_ / 2, and the largest double below side_.
  double half_ = 0;
  double below_side_ = 0;
};

// Zero and overflowing directions also map to a cell.
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
  // Arithmetic on truth values, because compilers turn conditions into branches.
  const uint32_t low = v1 > v0;
  const uint32_t high = 2 + (v3 > v2);
  const uint32_t is_high = high_value > low_value;
  const uint32_t best = (low & (is_high - 1)) | (high & -is_high);
  return {cell.ids[best], std::max(low_value, high_value)};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_
