#ifndef HULLD_CORE_QUERY_SUPPORT_MAP_H_
#define HULLD_CORE_QUERY_SUPPORT_MAP_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/hull/hull.h"
#include "core/numeric/vector.h"

namespace hulld {

// Finds the vertices of a hull that lie farthest along a direction.
//
// A small hull is scanned, four vertices at a time. A large one is climbed: from a start vertex,
// looked up by direction in a cube map, along edges to ever farther vertices. On a convex polytope
// a path of edges that never descends leads from every vertex to the farthest, so that a vertex
// whose neighbours are all nearer is the farthest. Rounding blurs that: where some neighbour is
// within `blur` of the vertex, the plateau of vertices within `blur` is flooded, which holds the
// path. The portable and the AVX2 path give the same bits. Source: Cameron 1997 (Enhancing GJK) for
// climbing.
//
// Values n . v are computed as (n.x v.x + n.y v.y) + n.z v.z. `blur` must be at least twice the
// largest error of such a value over the vertices of the hull.
class SupportMap {
 public:
  SupportMap() = default;
  // `hull` must outlive the map. Cost: O(V) on average.
  explicit SupportMap(const Hull& hull);

  struct Support {
    uint32_t vertex = 0;
    double value = 0;
    // Whether `value` is the largest computed value of all vertices, or within `blur` of one that
    // is not.
    bool certain = false;
  };

  // A vertex far along n, the farthest where certain. Requires the hull not empty.
  Support Farthest(const Vector& n, double blur) const;

  // The same, always certain: floods the plateau where need be.
  Support CertainFarthest(const Vector& n, double blur) const;

  // All vertices whose computed value is within `slack` of the largest, ascending. Requires slack
  // >= blur.
  std::vector<uint32_t> Plateau(const Vector& n, double slack) const;

  size_t MemoryBytes() const;

 private:
  // Four vertices, as structure of arrays; the last ones repeated where there are fewer.
  struct Block {
    double x[4];
    double y[4];
    double z[4];
  };
  struct NeighborBlock {
    Block positions;
    uint32_t ids[4];
  };

  static void Fill(Block& block, std::span<const Vector> positions);
  void BuildNeighbors(const Hull& hull);
  void BuildStarts();
  Support Scan(const Vector& n) const;
  Support Climb(uint32_t start, const Vector& n, double blur) const;
  template <typename Visit>
  bool VisitPlateau(const Support& from, const Vector& n, double slack, Visit visit) const;
  uint32_t StartOf(const Vector& n) const;
  double ValueOf(uint32_t vertex, const Vector& n) const;
  // One for each instruction set; the same bits.
  Support ScanPortably(const Vector& n) const;
  Support ScanAvx2(const Vector& n) const;
  Support ClimbPortably(uint32_t start, const Vector& n, double blur) const;
  Support ClimbAvx2(uint32_t start, const Vector& n, double blur) const;

  std::span<const Vector> vertices_;
  // Small hulls: all vertices.
  std::vector<Block> blocks_;
  // Large hulls: the neighbours of vertex i are in blocks neighbor_starts_[i] to [i + 1].
  std::vector<NeighborBlock> neighbors_;
  std::vector<uint32_t> neighbor_starts_;
  // Large hulls: a vertex far along the centre of each cell of the cube map, 6 x side x side.
  std::vector<uint32_t> starts_;
  uint32_t side_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_SUPPORT_MAP_H_
