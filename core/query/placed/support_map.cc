#include "core/query/placed/support_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include "core/numeric/simd_path.h"

namespace hulld {
namespace {

// Up to this many vertices are scanned: ten blocks of four. A choice, not tuned.
constexpr size_t kMostScanned = 40;
// Cells of the cube map per vertex. A choice: two of 16 bytes each keep all that queries need
// beyond the snapshot below 75 bytes a vertex (observed: tests/core/hull/growth/hull_cost_test).
constexpr double kCellsPerVertex = 2;
// A cell with more vertices than this lists one of them, to climb from.
constexpr size_t kMostListed = 24;
// A plateau larger than this is not flooded; every vertex is looked at instead.
constexpr size_t kMostFlooded = 64;
// How far, in cells, arcs are drawn beyond where they pass: far more than rounding, far less than a
// cell.
constexpr double kArcMargin = 1e-7;

// Four doubles, and four integers as wide, in whatever registers the function is compiled for.
using Lanes = double __attribute__((vector_size(32)));
using LaneIds = int64_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void Load(const double* from, Lanes& lanes) {
  std::memcpy(&lanes, from, sizeof lanes);
}

[[gnu::always_inline]] inline void Broadcast(double value, Lanes& lanes) {
  lanes = Lanes{value, value, value, value};
}

// The values along (x, y, z) of four vertices.
template <typename Block>
[[gnu::always_inline]] inline void Evaluate(const Block& block, const Lanes& x, const Lanes& y,
                                            const Lanes& z, Lanes& values) {
  Lanes px, py, pz;
  Load(block.x, px);
  Load(block.y, py);
  Load(block.z, pz);
  values = (x * px + y * py) + z * pz;
}

// The lane with the largest value, of these the one with the lowest id.
[[gnu::always_inline]] inline int LargestLane(const Lanes& values, const LaneIds& ids) {
  int best = 0;
  for (int i = 1; i < 4; ++i) {
    if (values[i] > values[best] || (values[i] == values[best] && ids[i] < ids[best])) best = i;
  }
  return best;
}

template <typename Block, typename Support>
[[gnu::always_inline]] inline void ScanBlocks(const std::vector<Block>& blocks, size_t count,
                                              const PlainVector& n, Support& support) {
  Lanes x, y, z, best, values;
  Broadcast(n.x, x);
  Broadcast(n.y, y);
  Broadcast(n.z, z);
  Evaluate(blocks[0], x, y, z, best);
  LaneIds best_ids = {0, 1, 2, 3};
  LaneIds ids = best_ids;
  const LaneIds four = {4, 4, 4, 4};
  for (size_t i = 1; i < blocks.size(); ++i) {
    ids += four;
    Evaluate(blocks[i], x, y, z, values);
    const LaneIds better = values > best;
    best = better ? values : best;
    best_ids = better ? ids : best_ids;
  }
  const int lane = LargestLane(best, best_ids);
  support.vertex =
      static_cast<uint32_t>(std::min<int64_t>(best_ids[lane], static_cast<int64_t>(count) - 1));
  support.value = best[lane];
  support.certain = true;
}

// The area vector of a facet, from the outside.
Vector NormalOf(std::span<const uint32_t> facet, std::span<const Vector> vertices) {
  const Vector& origin = vertices[facet[0]];
  Vector normal = Vector::Zero();
  for (size_t i = 2; i < facet.size(); ++i) {
    normal += (vertices[facet[i - 1]] - origin).cross(vertices[facet[i]] - origin);
  }
  return normal;
}

// The size of the vertices' bounding box, relative to its longest side; at least a thousandth of
// it.
Vector ExtentsOf(std::span<const Vector> vertices) {
  Vector low = vertices[0];
  Vector high = vertices[0];
  for (const Vector& vertex : vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  // Halved first, so that it does not overflow.
  const Vector extents = 0.5 * high - 0.5 * low;
  constexpr double kLeastExtent = 1e-3;
  return (extents / extents.maxCoeff()).cwiseMax(kLeastExtent);
}

}  // namespace

// Draws the arcs of the Gauss map into cells.
class SupportMap::ArcDrawing {
 public:
  explicit ArcDrawing(uint32_t side) : side_(side) {}

  // The arc between directions m and n, where the cones of two vertices meet.
  void Draw(const Vector& m, const Vector& n, uint32_t first, uint32_t second) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        double from = 0;
        double to = 1;
        // The part of m + t (n - m) on this face: the face's component is positive and at least as
        // large as each of the others, but for rounding.
        for (const uint32_t other : {kCubeAxisAfter[axis], kCubeAxisAfter[axis + 1]}) {
          for (const double side : {1.0, -1.0}) {
            Clip(sign * m[axis] + side * m[other], sign * n[axis] + side * n[other], &from, &to);
          }
        }
        if (!(from <= to)) continue;
        DrawOnFace(axis, sign, m + from * (n - m), m + to * (n - m), first, second);
      }
    }
  }

  std::vector<CellVertex> Take() { return std::move(entries_); }

 private:
  // Keeps those t in [from, to] where the linear function that is a at 0 and b at 1 is not
  // negative.
  static void Clip(double a, double b, double* from, double* to) {
    constexpr double kSlack = 1e-9;
    a += kSlack;
    b += kSlack;
    if (a >= 0 && b >= 0) return;
    if (a < 0 && b < 0) {
      *from = 2;
      return;
    }
    const double zero = a / (a - b);
    if (a < 0) {
      *from = std::max(*from, zero);
    } else {
      *to = std::min(*to, zero);
    }
  }

  double Place(double component, double along) const {
    return (component / along + 1) * 0.5 * side_;
  }
  uint32_t Index(double place) const {
    return static_cast<uint32_t>(std::clamp(place, 0.0, side_ - 1.0));
  }

  void DrawOnFace(uint32_t axis, double sign, const Vector& m, const Vector& n, uint32_t first,
                  uint32_t second) {
    const double m_along = sign * m[axis];
    const double n_along = sign * n[axis];
    if (!(m_along > 0 && n_along > 0)) return;
    double x0 = Place(m[kCubeAxisAfter[axis]], m_along);
    double y0 = Place(m[kCubeAxisAfter[axis + 1]], m_along);
    double x1 = Place(n[kCubeAxisAfter[axis]], n_along);
    double y1 = Place(n[kCubeAxisAfter[axis + 1]], n_along);
    if (x0 > x1) {
      std::swap(x0, x1);
      std::swap(y0, y1);
    }
    const uint32_t face = CubeFace(axis, sign < 0);
    const double slope = x1 > x0 ? (y1 - y0) / (x1 - x0) : 0;
    for (uint32_t i = Index(x0 - kArcMargin); i <= Index(x1 + kArcMargin); ++i) {
      double low = y0;
      double high = y1;
      if (x1 - x0 > kArcMargin) {
        low = y0 + slope * (std::clamp<double>(i, x0, x1) - x0);
        high = y0 + slope * (std::clamp<double>(i + 1.0, x0, x1) - x0);
      }
      if (low > high) std::swap(low, high);
      for (uint32_t j = Index(low - kArcMargin); j <= Index(high + kArcMargin); ++j) {
        const uint32_t cell = CubeCell(face, side_, i, j);
        entries_.push_back({cell, first});
        entries_.push_back({cell, second});
      }
    }
  }

  const uint32_t side_;
  std::vector<CellVertex> entries_;
};

SupportMap::SupportMap(const Hull& hull) : vertices_(hull.vertices()) {
  // A flat hull's Gauss map has arcs of half a circle; as large flat hulls are rare, it is scanned.
  if (vertices_.size() <= kMostScanned || hull.dimension() < 3) {
    BuildBlocks();
    return;
  }
  BuildNeighbors(hull);
  BuildCells(hull);
}

void SupportMap::BuildBlocks() {
  blocks_.resize((vertices_.size() + 3) / 4);
  for (size_t i = 0; i < 4 * blocks_.size(); ++i) {
    const Vector& vertex = vertices_[std::min(i, vertices_.size() - 1)];
    blocks_[i / 4].x[i % 4] = vertex.x();
    blocks_[i / 4].y[i % 4] = vertex.y();
    blocks_[i / 4].z[i % 4] = vertex.z();
  }
}

void SupportMap::BuildNeighbors(const Hull& hull) {
  neighbor_starts_.resize(vertices_.size() + 1);
  for (const Edge& edge : hull.edges()) {
    ++neighbor_starts_[edge.tail + 1];
    ++neighbor_starts_[edge.head + 1];
  }
  std::partial_sum(neighbor_starts_.begin(), neighbor_starts_.end(), neighbor_starts_.begin());
  neighbors_.resize(neighbor_starts_.back());
  std::vector<uint32_t> next(neighbor_starts_.begin(), neighbor_starts_.end() - 1);
  for (const Edge& edge : hull.edges()) {
    neighbors_[next[edge.tail]++] = edge.head;
    neighbors_[next[edge.head]++] = edge.tail;
  }
}

void SupportMap::BuildCells(const Hull& hull) {
  const double cells = kCellsPerVertex * static_cast<double>(vertices_.size());
  side_ = std::max(2u, static_cast<uint32_t>(std::lround(std::sqrt(cells / 6))));
  half_ = 0.5 * side_;
  below_half_ = half_ * (1 - 0x1p-40);
  const Vector scale = ExtentsOf(vertices_);
  scale_ = scale;

  // Of each edge the normals on its two sides, in the map's directions, of unit length.
  std::vector<std::array<Vector, 2>> sides(hull.edges().size());
  for (size_t f = 0; f < hull.facet_count(); ++f) {
    const std::span<const uint32_t> facet = hull.facet(f);
    const Vector normal = NormalOf(facet, vertices_).cwiseProduct(scale).stableNormalized();
    for (size_t i = 0; i < facet.size(); ++i) {
      const uint32_t tail = facet[i];
      const uint32_t head = facet[i + 1 < facet.size() ? i + 1 : 0];
      const Edge edge{std::min(tail, head), std::max(tail, head)};
      const auto found = std::lower_bound(hull.edges().begin(), hull.edges().end(), edge);
      sides[found - hull.edges().begin()][tail < head] = normal;
    }
  }
  ArcDrawing drawing(side_);
  for (size_t e = 0; e < sides.size(); ++e) {
    drawing.Draw(sides[e][0], sides[e][1], hull.edges()[e].tail, hull.edges()[e].head);
  }
  FillCells(drawing.Take());
}

// Sorts the entries by cell. A cell without any lies within the cone of one vertex.
void SupportMap::FillCells(std::vector<CellVertex> entries) {
  std::sort(entries.begin(), entries.end());
  entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
  cells_.resize(size_t{6} * side_ * side_);
  std::vector<uint32_t> listed;
  uint32_t last = 0;
  auto entry = entries.begin();
  for (uint32_t c = 0; c < cells_.size(); ++c) {
    listed.clear();
    for (; entry != entries.end() && entry->cell == c; ++entry) listed.push_back(entry->vertex);
    const bool too_many = listed.size() > kMostListed;
    if (listed.empty() || too_many) {
      listed.assign(1, Climb({last, -INFINITY, false}, CenterOf(c)).vertex);
    }
    last = listed.back();
    Cell& cell = cells_[c];
    for (size_t i = 0; i < 4; ++i) cell.ids[i] = listed[std::min(i, listed.size() - 1)];
    if (listed.size() <= 4 && !too_many) continue;
    cell.ids[3] = kLong + static_cast<uint32_t>(lists_.size());
    lists_.push_back(static_cast<uint32_t>(listed.size()));
    lists_.insert(lists_.end(), listed.begin(), listed.end());
  }
  lists_.shrink_to_fit();
}

// A direction of the hull's frame in the middle of a cell.
Vector SupportMap::CenterOf(uint32_t cell) const {
  const double s = (2.0 * (cell / side_ % side_) + 1) / side_ - 1;
  const double t = (2.0 * (cell % side_) + 1) / side_ - 1;
  return CubeDirection(cell / (side_ * side_), s, t).cwiseQuotient(Vector(scale_));
}

SupportMap::Support SupportMap::LookUpLong(const Cell& cell, const PlainVector& n) const {
  const uint32_t* const list = lists_.data() + (cell.ids[3] - kLong);
  Support best{list[1], ValueOf(list[1], n), false};
  // A single one stands for many.
  if (list[0] == 1) return Climb(best, n);
  for (uint32_t i = 2; i <= list[0]; ++i) {
    const double value = ValueOf(list[i], n);
    if (value > best.value) best = {list[i], value, false};
  }
  return best;
}

SupportMap::Support SupportMap::Climb(Support from, const PlainVector& n) const {
  for (;;) {
    Support best = from;
    for (const uint32_t id : NeighborsOf(from.vertex)) {
      const double value = ValueOf(id, n);
      if (value > best.value) best = {id, value, false};
    }
    if (best.vertex == from.vertex) return from;
    from = best;
  }
}

SupportMap::Support SupportMap::ScanPortably(const PlainVector& n) const {
  Support support;
  ScanBlocks(blocks_, vertices_.size(), n, support);
  return support;
}

#ifdef HULLD_HAS_AVX2_PATH
__attribute__((target("avx2"))) SupportMap::Support SupportMap::ScanAvx2(
    const PlainVector& n) const {
  Support support;
  ScanBlocks(blocks_, vertices_.size(), n, support);
  return support;
}
#else
SupportMap::Support SupportMap::ScanAvx2(const PlainVector& n) const { return ScanPortably(n); }
#endif

SupportMap::Support SupportMap::Scan(const PlainVector& n) const {
  return CurrentSimdPath() == SimdPath::kAvx2 ? ScanAvx2(n) : ScanPortably(n);
}

// Calls visit(vertex, value) for all vertices with a value of at least from.value - slack, or says
// false when there are too many. Such vertices are connected by edges among themselves.
template <typename Visit>
bool SupportMap::VisitPlateau(const Support& from, const PlainVector& n, double slack,
                              Visit visit) const {
  const double least = from.value - slack;
  std::array<uint32_t, kMostFlooded> found;
  size_t count = 1;
  found[0] = from.vertex;
  visit(from.vertex, from.value);
  for (size_t next = 0; next < count; ++next) {
    for (const uint32_t id : NeighborsOf(found[next])) {
      const double value = ValueOf(id, n);
      if (!(value >= least)) continue;
      if (std::find(found.begin(), found.begin() + count, id) != found.begin() + count) continue;
      if (count == kMostFlooded) return false;
      found[count++] = id;
      visit(id, value);
    }
  }
  return true;
}

SupportMap::Support SupportMap::MakeCertain(Support from, const PlainVector& n, double blur) const {
  double nearest = -INFINITY;
  for (const uint32_t id : NeighborsOf(from.vertex)) nearest = std::max(nearest, ValueOf(id, n));
  if (nearest < from.value - blur) return {from.vertex, from.value, true};
  from = Climb(from, n);
  Support best = from;
  const auto consider = [&](uint32_t vertex, double value) {
    if (value > best.value || (value == best.value && vertex < best.vertex)) {
      best = {vertex, value, true};
    }
  };
  if (!VisitPlateau(from, n, blur, consider)) {
    for (uint32_t i = 0; i < vertices_.size(); ++i) consider(i, ValueOf(i, n));
  }
  best.certain = true;
  return best;
}

std::vector<uint32_t> SupportMap::Plateau(const PlainVector& n, double slack) const {
  const Support top = CertainFarthest(n, slack);
  const double least = top.value - slack;
  std::vector<uint32_t> plateau;
  const auto add = [&](uint32_t vertex, double value) {
    if (value >= least) plateau.push_back(vertex);
  };
  if (!blocks_.empty() || !VisitPlateau(top, n, slack, add)) {
    plateau.clear();
    for (uint32_t i = 0; i < vertices_.size(); ++i) add(i, ValueOf(i, n));
  }
  std::sort(plateau.begin(), plateau.end());
  return plateau;
}

size_t SupportMap::MemoryBytes() const {
  return blocks_.capacity() * sizeof(Block) + cells_.capacity() * sizeof(Cell) +
         (neighbor_starts_.capacity() + neighbors_.capacity() + lists_.capacity()) *
             sizeof(uint32_t);
}

}  // namespace hulld
