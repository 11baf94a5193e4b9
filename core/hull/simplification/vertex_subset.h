#ifndef HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_

#include <cstdint>
#include <optional>
#include <queue>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"
#include "core/numeric/vector.h"

namespace hulld {

// A growing subset of the vertices of a hull of dimension 3. The next one is usually the vertex
// farthest from the hull of the chosen ones.
//
// The hull of the chosen vertices grows exactly, like any hull. Each remaining vertex waits in the
// list of a triangle that is strictly visible from it. Such a triangle exists, because each vertex
// of the full hull is outside the hull of any other vertices. The distance to that triangle bounds
// the distance to the hull. When triangles are replaced, a vertex of their lists is moved to the
// list of the new triangle whose plane it is highest above. That triangle is the nearest one if the
// vertex lies over it. Source: Barber, Dobkin and Huhdanpaa 1996 (Quickhull) for the lists; Kamenev
// 1992, A Class of Adaptive Algorithms for Approximating Convex Bodies by Polyhedra, for the order
// and its quality.
class VertexSubset {
 public:
  // points: all vertices of a hull of dimension 3; unit_points: the same vertices at unit scale.
  // Both must outlive this object. Starts with four vertices. If the poll stopped, here or in
  // ChooseNext, this object may only be destroyed. Cost: O(points).
  VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points, StopPoll& poll);
  // Starts with the given vertices, without duplicates. Returns nothing if they lie in a plane or
  // the poll stopped. Cost: that of as many calls of ChooseNext, if the order is roughly farthest
  // first.
  static std::optional<VertexSubset> StartingWith(std::span<const uint32_t> start,
                                                  std::span<const Vector> points,
                                                  std::span<const Vector> unit_points,
                                                  StopPoll& poll);

  // Indices, in the order chosen.
  const std::vector<uint32_t>& chosen() const { return chosen_; }
  bool is_complete() const { return chosen_.size() == points_.size(); }
  // Chooses the apparently farthest vertex. Requires: !is_complete(). Cost: O((V + n) log n) for n
  // choices of V vertices of round shapes.
  void ChooseNext(StopPoll& poll);
  // Returns a **proven** bound, in units, on the distance of any vertex from the hull of the chosen
  // vertices. Cost: O(log V) amortized.
  double DistanceBound();

 private:
  static constexpr uint32_t kNone = UINT32_MAX;
  // The distance of a chosen vertex, less than any real one.
  static constexpr double kChosen = -1;

  // Data for a triangle of the surface: a corner and the unit normal, rounded, at unit scale, and
  // the list of vertices.
  struct Cell {
    Vector corner = Vector::Zero();
    Vector normal = Vector::Zero();
    uint32_t first = kNone;
    // The farthest vertex of the list.
    uint32_t farthest = kNone;
  };
  // Stale if the vertex's distance has changed since.
  struct Entry {
    double distance;
    uint32_t point;
    bool operator<(const Entry& other) const {
      return distance != other.distance ? distance < other.distance : point > other.point;
    }
  };

  VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points);
  bool StartWithCornersOf(std::span<const uint32_t> candidates, StopPoll& poll);
  void Choose(uint32_t point, StopPoll& poll);
  void MakeCell(TriangleId id);
  double HeightOver(TriangleId id, uint32_t point) const {
    return cells_[id].normal.dot(unit_points_[point] - cells_[id].corner);
  }
  bool Sees(uint32_t point, TriangleId id) const {
    return surface_->IsSeenFrom(vertices_, id, points_[point]);
  }
  double DistanceTo(TriangleId id, uint32_t point) const;
  void Assign(uint32_t point, std::span<const TriangleId> targets);
  void Enqueue(std::span<const TriangleId> ids);

  std::span<const Vector> points_;
  std::span<const Vector> unit_points_;
  // The chosen vertices, with their places in chosen_ as IDs, and the boundary of their hull.
  VertexTable vertices_;
  std::optional<Surface> surface_;
  std::vector<uint32_t> chosen_;
  // By triangle.
  std::vector<Cell> cells_;
  // By point: a proven bound on its distance, or kChosen. If not chosen: the triangle of its list,
  // and the next point there.
  std::vector<double> distance_;
  std::vector<TriangleId> triangle_;
  std::vector<uint32_t> next_;
  // An entry for the farthest vertex of each list, and stale entries.
  std::priority_queue<Entry> queue_;
  // Vertices of removed triangles.
  std::vector<uint32_t> orphans_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_
