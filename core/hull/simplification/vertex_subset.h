#ifndef HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_

#include <cstdint>
#include <optional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"
#include "core/numeric/vector.h"

namespace hulld {

// A growing subset of the vertices of a hull of dimension 3, the next one always the vertex
// farthest from the hull of those chosen, as far as rounding can tell.
//
// Idea: the hull of those chosen grows as any hull does, exactly, and each other vertex waits in
// the list of a triangle that it sees strictly: a vertex of the whole is outside the hull of any
// others. The distance to that triangle bounds the distance to the hull. A vertex is given to the
// triangle whose plane it is highest above, which is the nearest where the vertex lies over it.
// Triangles that come later may be nearer still; that is looked at when a vertex seems the farthest
// of all, and not before. Source: Barber, Dobkin and Huhdanpaa 1996 (Quickhull) for the lists;
// Kamenev 1992, A Class of Adaptive Algorithms for Approximating Convex Bodies by Polyhedra, for
// the order and what it is worth.
class VertexSubset {
 public:
  // points: all vertices of a hull of dimension 3; unit_points: the same at unit scale. Both must
  // outlive this. Starts with four. After the poll said stop, here or in ChooseNext, this may only
  // be destroyed. Cost: O(points).
  VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points, StopPoll& poll);
  // The same, but it starts with the vertices given, each once. Nothing where these lie in a plane,
  // where no double is found inside their hull, where walks on it are longer than round shapes
  // need, and after the poll said stop. Cost: O(points) walks.
  static std::optional<VertexSubset> StartingWith(std::span<const uint32_t> start,
                                                  std::span<const Vector> points,
                                                  std::span<const Vector> unit_points,
                                                  StopPoll& poll);

  // Indices, in the order chosen.
  const std::vector<uint32_t>& chosen() const { return chosen_; }
  bool is_complete() const { return chosen_.size() == points_.size(); }
  // See Surface.
  bool IsMeasurable() const { return surface_->IsMeasurable(); }
  // Chooses the vertex that seems farthest. Requires !is_complete(). Cost: O((V + n) log n) for n
  // choices of V vertices of round shapes.
  void ChooseNext(StopPoll& poll);
  // Proven: no vertex is farther than this from the hull of those chosen. In units. Cost: O(log V)
  // amortized.
  double DistanceBound();

 private:
  static constexpr uint32_t kNone = UINT32_MAX;

  // What the subset keeps for a triangle of the surface: a corner and the unit normal, rounded, at
  // unit scale, and the list of vertices.
  struct Cell {
    Vector corner = Vector::Zero();
    Vector normal = Vector::Zero();
    uint32_t first = kNone;
    // The farthest of the list.
    uint32_t farthest = kNone;
    // The number of the last entry of the queue that is about this cell.
    uint64_t entry = 0;
    // The list has changed since.
    bool is_changed = false;
  };
  struct Entry {
    double distance;
    TriangleId triangle;
    uint64_t number;
    bool operator<(const Entry& other) const {
      return distance != other.distance ? distance < other.distance : triangle > other.triangle;
    }
  };

  VertexSubset(std::span<const Vector> points, std::span<const Vector> unit_points);
  bool StartWithCornersOf(std::span<const uint32_t> candidates, StopPoll& poll);
  bool ChooseRestOf(std::span<const uint32_t> start, StopPoll& poll);
  bool AssignRest(StopPoll& poll);
  std::vector<TriangleId> MakeCells();
  bool IsSlow() const;
  void MakeCell(TriangleId id);
  double HeightOver(TriangleId id, uint32_t point) const {
    return cells_[id].normal.dot(unit_points_[point] - cells_[id].corner);
  }
  bool Sees(uint32_t point, TriangleId id) const {
    return surface_->IsSeenFrom(vertices_, id, points_[point]);
  }
  double DistanceTo(TriangleId id, uint32_t point) const;
  void Assign(uint32_t point, std::span<const TriangleId> targets);
  void Link(TriangleId id, uint32_t point, double distance);
  void NoteChange(TriangleId id) {
    if (!std::exchange(cells_[id].is_changed, true)) changed_.push_back(id);
  }
  void EnqueueChanged();
  void Redistribute(TriangleId id);
  TriangleId ClimbFrom(TriangleId id, uint32_t point) const;
  TriangleId Worst();

  std::span<const Vector> points_;
  std::span<const Vector> unit_points_;
  // The chosen vertices, whose IDs are their places in chosen_, and the boundary of their hull.
  VertexTable vertices_;
  std::optional<Surface> surface_;
  std::vector<uint32_t> chosen_;
  // By triangle.
  std::vector<Cell> cells_;
  // By point that is not chosen: the next one of its list, and a proven bound of its distance.
  std::vector<uint32_t> next_;
  std::vector<double> distance_;
  // Each cell with a list has one entry that counts, and may have some that no longer do.
  std::priority_queue<Entry> queue_;
  uint64_t entries_ = 0;
  // Triangles whose lists changed since they were put into the queue.
  std::vector<TriangleId> changed_;
  // Vertices whose triangles went.
  std::vector<uint32_t> orphans_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_
