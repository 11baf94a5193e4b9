#ifndef HULLD_CORE_HULL_SURFACE_H_
#define HULLD_CORE_HULL_SURFACE_H_

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/hull/vertex_table.h"

namespace hulld {

using TriangleId = uint32_t;

// A triangle of the surface, counter-clockwise seen from outside; neighbours[i] lies across the
// edge from corners[i] to corners[(i + 1) % 3].
struct SurfaceTriangle {
  std::array<VertexId, 3> corners;
  std::array<TriangleId, 3> neighbours;
};

// The triangulated boundary of a growing convex polytope of dimension 3, exactly.
//
// Idea: to add a point that sees some triangle strictly from outside, remove every triangle that it
// sees strictly or whose plane it lies in, and join the point to the horizon, the boundary of what
// was removed. Removing the coplanar triangles too is what keeps the vertex set minimal: it is the
// visible region of the point moved outwards by an infinitesimal amount, hence a disk; a vertex
// that the new point makes non-extreme has only such triangles around it and goes with them; and
// every triangle beyond the horizon is strictly invisible, so that no new triangle is degenerate
// and no horizon vertex redundant.
//
// The triangle to start from is found by walking on the surface, towards the one that the ray from
// a fixed interior point through the new point pierces. Source: Clarkson and Shor 1989 for the
// incremental hull; Devillers, Pion and Teillaud 2002 for the walk.
class Surface {
 public:
  // The cone from `apex` over a polygon whose plane does not hold it. `polygon`: vertices in order,
  // either way round.
  Surface(const VertexTable& vertices, std::span<const VertexId> polygon, VertexId apex);

  // Adds a point. Cost: the triangles removed and created, and a walk of a few exact signs; a scan
  // of all triangles where no double lies strictly inside the polytope.
  void Insert(VertexTable& vertices, const Vector& point);

  // Calls visit(id, triangle) for every triangle.
  template <typename Visitor>
  void ForEachTriangle(Visitor&& visit) const {
    for (TriangleId id = 0; id < triangles_.size(); ++id) {
      if (IsAlive(id)) visit(id, triangles_[id]);
    }
  }
  const SurfaceTriangle& triangle(TriangleId id) const { return triangles_[id]; }
  // IDs of triangles lie below this.
  size_t id_bound() const { return triangles_.size(); }

 private:
  struct HorizonEdge {
    VertexId tail;
    VertexId head;
    TriangleId beyond;
  };
  enum class Side { kInside, kOutside };
  // Where a point lies, and a triangle that it sees strictly (outside) or whose cone holds it
  // (inside).
  struct Location {
    Side side;
    TriangleId triangle;
  };

  bool IsAlive(TriangleId id) const { return triangles_[id].corners[0] != kDead; }
  int SideOf(const VertexTable& vertices, TriangleId id, const Vector& point) const;
  TriangleId AddTriangle(VertexId a, VertexId b, VertexId c);
  void LinkAll();

  Location Locate(const VertexTable& vertices, const Vector& point);
  std::optional<Location> Walk(const VertexTable& vertices, const Vector& point);
  Location Scan(const VertexTable& vertices, const Vector& point) const;
  void CountIfDuplicate(VertexTable& vertices, const Location& location, const Vector& point) const;
  size_t HintCell(const Vector& point) const;
  void UpdateInterior(const VertexTable& vertices);
  bool IsStrictlyInside(const VertexTable& vertices, const Vector& point) const;

  void CollectRegion(const VertexTable& vertices, TriangleId first, const Vector& point);
  void RemoveRegion(VertexTable& vertices);
  void JoinHorizon(VertexId apex);

  static constexpr VertexId kDead = UINT32_MAX;

  std::vector<SurfaceTriangle> triangles_;
  std::vector<TriangleId> free_;
  size_t alive_ = 0;

  // A point strictly inside, when one is known: it stays so while the polytope grows.
  std::optional<Vector> interior_;
  // The count of triangles at which an interior point is looked for again and the hints are laid
  // anew.
  size_t next_update_ = 0;
  // Where the last walk in a direction from the interior point ended, per cell of a cube map; may
  // name a dead triangle.
  std::vector<TriangleId> hints_;
  int hint_resolution_ = 1;
  TriangleId last_ = 0;
  uint32_t random_ = 1;

  // Scratch of one insertion.
  std::vector<TriangleId> region_;
  std::vector<uint64_t> region_mark_;
  std::vector<HorizonEdge> horizon_;
  std::vector<uint64_t> horizon_mark_;
  std::vector<TriangleId> triangle_from_;
  uint64_t mark_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_H_
