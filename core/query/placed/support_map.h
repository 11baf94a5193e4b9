#ifndef HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_
#define HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/hull/hull.h"
#include "core/numeric/cube_map.h"
#include "core/numeric/vector.h"
#include "core/query/placed/plain_vector.h"

namespace hulld {

// Finds the vertices of a hull that lie farthest along a direction.
//
// A small hull is scanned, four vertices at a time. For a large one the directions are divided into
// the cells of a cube map, each of which lists the vertices that are farthest along some direction
// in it: those whose normal cone meets the cell. The lists are made by drawing the edges of the
// Gauss map (the arcs between the normals of neighbouring facets) into the cells; a cell without
// any lies within one cone. Directions are first scaled by the extents of the hull, so that the
// cells of an oblong hull are filled evenly. As rounding may misplace an arc, what a list gives is
// certain only once its neighbours were looked at: on a convex polytope a path of edges that never
// descends leads from every vertex to the farthest, so that a vertex whose neighbours are all
// nearer is the farthest; where some neighbour is within `blur` of it, the plateau of vertices
// within `blur` is flooded, which holds the path.
//
// Values n . v are computed as (n.x v.x + n.y v.y) + n.z v.z, the same bits on any instruction set.
// `blur` must be at least twice the largest error of such a value over the vertices of the hull.
class SupportMap {
 public:
  SupportMap() = default;
  // `hull` must outlive the map. Cost: O(V), for a large hull O(V log V).
  explicit SupportMap(const Hull& hull);

  struct Support {
    uint32_t vertex = 0;
    double value = 0;
    // Whether `value` is the largest computed value of all vertices.
    bool certain = false;
  };

  // A vertex far along n, the farthest where certain and almost always otherwise. Requires the hull
  // not empty. Cost: O(V) for a small hull, O(1) on average for a large one.
  Support Farthest(const PlainVector& n) const {
    HULLD_DCHECK(!vertices_.empty());
    return cells_.empty() ? Scan(n) : LookUp(n);
  }

  // The farthest: `value` is within `blur` of the largest computed value.
  Support CertainFarthest(const PlainVector& n, double blur) const {
    return CertainFarthest(n, blur, Farthest(n).vertex);
  }
  // The same, from what Farthest(n) found.
  Support CertainFarthest(const PlainVector& n, double blur, uint32_t found) const {
    const Support from{found, ValueOf(found, n), cells_.empty()};
    return from.certain ? from : MakeCertain(from, n, blur);
  }

  // All vertices whose computed value is within `slack` of the largest, ascending. Requires slack
  // >= blur (unchecked: the map does not know the caller's blur).
  std::vector<uint32_t> Plateau(const PlainVector& n, double slack) const;

  size_t MemoryBytes() const;

 private:
  // Four vertices, as structure of arrays; the last one repeated where there are fewer.
  struct Block {
    double x[4];
    double y[4];
    double z[4];
  };
  // The vertices of a cell of the cube map, repeated where there are fewer than four. Where there
  // are more, ids[3] is kLong plus where in lists_ their number and they begin.
  struct Cell {
    uint32_t ids[4];
  };
  static constexpr uint32_t kLong = uint32_t{1} << 31;
  struct CellVertex {
    uint32_t cell;
    uint32_t vertex;
    friend auto operator<=>(const CellVertex&, const CellVertex&) = default;
  };
  class ArcDrawing;

  void BuildBlocks();
  void BuildNeighbors(const Hull& hull);
  void BuildCells(const Hull& hull);
  void FillCells(std::vector<CellVertex> entries);

  std::span<const uint32_t> NeighborsOf(uint32_t vertex) const {
    return std::span(neighbors_)
        .subspan(neighbor_starts_[vertex], neighbor_starts_[vertex + 1] - neighbor_starts_[vertex]);
  }
  Support Scan(const PlainVector& n) const;
  Support ScanPortably(const PlainVector& n) const;
  Support ScanAvx2(const PlainVector& n) const;
  uint32_t CellOf(const PlainVector& n_own) const;
  Vector CenterOf(uint32_t cell) const;
  Support LookUp(const PlainVector& n) const;
  Support LookUpLong(const Cell& cell, const PlainVector& n) const;
  Support Climb(Support from, const PlainVector& n) const;
  Support MakeCertain(Support from, const PlainVector& n, double blur) const;
  template <typename Visit>
  bool VisitPlateau(const Support& from, const PlainVector& n, double slack, Visit visit) const;
  double ValueOf(uint32_t vertex, const PlainVector& n) const {
    const Vector& v = vertices_[vertex];
    return (n.x * v.x() + n.y * v.y()) + n.z * v.z();
  }

  std::span<const Vector> vertices_;
  // Small hulls: all vertices.
  std::vector<Block> blocks_;
  // Large hulls: the neighbours of vertex i are those from neighbor_starts_[i] to [i + 1].
  std::vector<uint32_t> neighbor_starts_;
  std::vector<uint32_t> neighbors_;
  // Large hulls: the cube map, 6 x side x side.
  std::vector<Cell> cells_;
  std::vector<uint32_t> lists_;
  PlainVector scale_ = {1, 1, 1};
  uint32_t side_ = 0;
  // side_ / 2, and a little less.
  double half_ = 0;
  double below_half_ = 0;
};

// Some cell also for n = 0 and for what overflows.
inline uint32_t SupportMap::CellOf(const PlainVector& n_own) const {
  const OnCube n(n_own.x * scale_.x, n_own.y * scale_.y, n_own.z * scale_.z);
  const double factor = half_ / n.largest();
  // Written so that NaN becomes a number.
  const auto index = [&](double component) {
    double place = component * factor;
    place = place < below_half_ ? place : below_half_;
    place = place > -below_half_ ? place : -below_half_;
    return static_cast<uint32_t>(static_cast<int64_t>(place + half_));
  };
  return CubeCell(n.face(), side_, index(n.first()), index(n.second()));
}

inline SupportMap::Support SupportMap::LookUp(const PlainVector& n) const {
  const Cell& cell = cells_[CellOf(n)];
  if (cell.ids[3] >= kLong) return LookUpLong(cell, n);
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
  return {cell.ids[best], std::max(low_value, high_value), false};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_SUPPORT_MAP_H_
