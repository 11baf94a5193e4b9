#ifndef HULLD_CORE_QUERY_SUPPORT_MAP_H_
#define HULLD_CORE_QUERY_SUPPORT_MAP_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/hull/hull.h"
#include "core/numeric/vector.h"

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
  Support Farthest(const Vector& n) const { return cells_.empty() ? Scan(n) : LookUp(n); }

  // The farthest: `value` is within `blur` of the largest computed value.
  Support CertainFarthest(const Vector& n, double blur) const {
    const Support found = Farthest(n);
    return found.certain ? found : MakeCertain(found, n, blur);
  }

  // All vertices whose computed value is within `slack` of the largest, ascending. Requires slack
  // >= blur.
  std::vector<uint32_t> Plateau(const Vector& n, double slack) const;

  size_t MemoryBytes() const;

 private:
  // The cube map's face along component `axis` has the two components after it as coordinates.
  static constexpr int kAfter[4] = {1, 2, 0, 1};
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
  Support Scan(const Vector& n) const;
  Support ScanPortably(const Vector& n) const;
  Support ScanAvx2(const Vector& n) const;
  uint32_t CellOf(const Vector& n_own) const;
  Vector CenterOf(uint32_t cell) const;
  Support LookUp(const Vector& n) const;
  Support LookUpLong(const Cell& cell, const Vector& n) const;
  Support Climb(Support from, const Vector& n) const;
  Support MakeCertain(Support from, const Vector& n, double blur) const;
  template <typename Visit>
  bool VisitPlateau(const Support& from, const Vector& n, double slack, Visit visit) const;
  double ValueOf(uint32_t vertex, const Vector& n) const {
    const Vector& v = vertices_[vertex];
    return (n.x() * v.x() + n.y() * v.y()) + n.z() * v.z();
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
  Vector scale_ = Vector::Ones();
  uint32_t side_ = 0;
};

// Without branches on data: directions come in no foreseeable order. Some cell also for n = 0 and
// for what overflows.
inline uint32_t SupportMap::CellOf(const Vector& n_own) const {
  const Vector n = n_own.cwiseProduct(scale_);
  const double x = std::abs(n.x());
  const double y = std::abs(n.y());
  const double z = std::abs(n.z());
  const int x_or_y = x >= y ? 0 : 1;
  const int axis = std::max(x, y) >= z ? x_or_y : 2;
  const double along = n[axis];
  const double half = 0.5 * side_;
  const double factor = half / std::abs(along);
  const double most = side_ - 1.0;
  // Written so that NaN becomes a number.
  const auto index = [&](double component) {
    double place = component * factor + half;
    place = place < most ? place : most;
    place = place > 0 ? place : 0;
    return static_cast<uint32_t>(static_cast<int64_t>(place));
  };
  const uint32_t face =
      2 * static_cast<uint32_t>(axis) + static_cast<uint32_t>(std::signbit(along));
  return (face * side_ + index(n[kAfter[axis]])) * side_ + index(n[kAfter[axis + 1]]);
}

inline SupportMap::Support SupportMap::LookUp(const Vector& n) const {
  const Cell& cell = cells_[CellOf(n)];
  if (cell.ids[3] >= kLong) return LookUpLong(cell, n);
  const double values[4] = {ValueOf(cell.ids[0], n), ValueOf(cell.ids[1], n),
                            ValueOf(cell.ids[2], n), ValueOf(cell.ids[3], n)};
  const int low = values[1] > values[0] ? 1 : 0;
  const int high = values[3] > values[2] ? 3 : 2;
  const int best = values[high] > values[low] ? high : low;
  return {cell.ids[best], values[best], false};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_SUPPORT_MAP_H_
