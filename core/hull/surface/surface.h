#ifndef HULLD_CORE_HULL_SURFACE_SURFACE_H_
#define HULLD_CORE_HULL_SURFACE_SURFACE_H_

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/scratch_list.h"
#include "core/base/stop_poll.h"
#include "core/hull/surface/chunked_vector.h"
#include "core/hull/surface/direction_map.h"
#include "core/hull/surface/kept_before.h"
#include "core/hull/surface/vertex_table.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"

namespace hulld {

using TriangleId = uint32_t;

// A triangle of the surface, counter-clockwise seen from outside, in one cache line. neighbours[i]
// lies across the edge from corners[i] to corners[(i + 1) % 3]. The last corner is the apex: the
// triangle was made when that vertex came, as one of a fan round it.
struct alignas(64) SurfaceTriangle {
  // The plane, rounded: normal . p - offset, which errs by at most slope * (|p| + |corner|), |.|
  // the largest component.
  Vector normal;
  double offset;
  std::array<VertexId, 3> corners;
  std::array<TriangleId, 3> neighbours;
  float slope;
  // The last traversal in whose region this triangle was.
  uint32_t mark : 29;
  // Bit i: the triangle beyond edge i is in the same plane. That is known where one of the two was
  // joined to the other across a horizon. It is not known of two that were made together; then the
  // bit is 0.
  uint32_t flat : 3;
};
static_assert(sizeof(SurfaceTriangle) == 64);

// The triangulated boundary of a growing convex polytope of dimension 3, exactly.
//
// Idea: to add a point that sees some triangle strictly from outside, remove every triangle that it
// sees strictly, and join the point to the horizon, the boundary of what was removed. A triangle
// beyond the horizon may lie in a plane with the point, and then the new one extends its facet: so
// a facet of many corners grows at one side and is left alone elsewhere. Where that would leave a
// vertex that is no longer extreme, one whose triangles that stay all lie in planes with the point,
// these triangles are removed as well. That keeps the vertex set minimal: a vertex stays extreme as
// long as some plane through it leaves the new point below. What is removed is a disk: what the
// point sees when moved inwards by an infinitesimal amount, and, in each facet that lies in a plane
// with the point, the triangles round consecutive corners; the point sees the edges of these that
// remain strictly from within that plane, as they are chords between corners that stay. So no new
// triangle is degenerate and no vertex of the horizon redundant.
//
// The triangle to start from is found by walking on the surface, towards the one that the ray from
// a fixed interior point through the new point pierces; a map of directions round that point
// rejects points that are certainly inside and tells where to start. Source: Clarkson and Shor 1989
// for the incremental hull; Devillers, Pion and Teillaud 2002 for the walk.
class Surface {
 public:
  // The cone from `apex` over a polygon, the base in triangles of which a line crosses few.
  // `polygon`: at least three vertices in order, either way round. Requires that the polygon's
  // plane does not hold the apex.
  Surface(const VertexTable& vertices, std::span<const VertexId> polygon, VertexId apex);

  // Adds a point. Cost: the triangles removed and created, and a walk of a few exact signs; a scan
  // of all triangles where no double lies strictly inside the polytope.
  void Insert(VertexTable& vertices, const Vector& point) {
    size_t cell = 0;
    if (directions_) {
      const DirectionMap::Place place = directions_->PlaceOf(point);
      ++asked_;
      if (directions_->IsCertainlyInside(place)) {
        ++rejected_;
        return;
      }
      cell = place.cell;
    }
    InsertSurvivor(vertices, point, cell);
  }

  // Where a point lies, and a triangle that it sees strictly (outside) or whose cone holds it
  // (inside).
  enum class Side { kInside, kOutside };
  struct Location {
    Side side;
    TriangleId triangle;
  };
  // Finds where a point lies, fast when the last point in its cell of the map lay near it. Requires
  // that an interior point is known; empty when the walk is longer than the surface warrants.
  std::optional<Location> Locate(const VertexTable& vertices, const Vector& point) {
    HULLD_CHECK(directions_.has_value());
    const size_t cell = directions_->PlaceOf(point).cell;
    const double size = SizeWith(vertices, point);
    const TriangleId start = Alive(directions_->hint(cell));
    ++work_;
    std::optional<Location> location = SeenNear(start, point, size);
    if (!location) location = Walk(vertices, point, size, start, work_);
    if (location) directions_->SetHint(cell, location->triangle);
    return location;
  }
  // True when the point lies strictly outside the triangle's plane, exactly.
  bool IsSeenFrom(const VertexTable& vertices, TriangleId id, const Vector& point) const {
    return SideOf(vertices, id, point, SizeWith(vertices, point)) > 0;
  }
  // The same where doubles are certain of it, and false where they are not.
  bool IsCertainlySeenFrom(const VertexTable& vertices, TriangleId id, const Vector& point) const {
    const SurfaceTriangle& t = triangles_[id];
    return t.normal.dot(point) - t.offset >
           static_cast<double>(t.slope) * SizeWith(vertices, point);
  }
  // True when the point lies in the triangle's plane, exactly.
  bool IsInPlane(const VertexTable& vertices, TriangleId id, const Vector& point) const {
    return SideOf(vertices, id, point, SizeWith(vertices, point)) == 0;
  }
  // Adds a point that sees the triangle `seen` strictly, in two steps: the first removes and
  // returns the triangles that go (that the point sees, and those round vertices that go), for the
  // caller to move what it keeps by triangle; the second joins the point to their boundary and
  // returns the triangles that come, which take over IDs. The spans hold until the next insertion.
  // In builds without NDEBUG the second checks the triangles that came (FindStarDefect).
  std::span<const TriangleId> RemoveVisible(VertexTable& vertices, const Vector& point,
                                            TriangleId seen);
  std::span<const TriangleId> JoinToBoundary(VertexTable& vertices, const Vector& point);
  // The corner of the triangle that the point equals.
  std::optional<VertexId> CornerAt(const VertexTable& vertices, TriangleId id,
                                   const Vector& point) const;
  // Steps of insertions since this was last asked, for a poll: one for each, and more for those
  // that change many triangles, or look for their place among many.
  uint64_t TakeSteps() { return std::exchange(steps_, 0); }
  // To be called before many points are inserted: measures the surface for its present size while
  // that goes on.
  void BeginInsertions(const VertexTable& vertices);
  // Does what insertions in two steps leave undone: housekeeping for what comes.
  void FinishInsertions(const VertexTable& vertices);

  // Starts a journal of what changes; makes all as it was then, but for hints where to start
  // looking; ends the journal and keeps what changed. Requires, in turn, that no journal is kept,
  // and that one is. Cost: the changes.
  void StartJournal();
  void Undo();
  void EndJournal();
  // What the journal holds.
  size_t JournalBytes() const;

  // The map of directions, for choosing what to insert and in which order; null where no interior
  // point is known.
  const DirectionMap* directions() const { return directions_ ? &*directions_ : nullptr; }
  // True when an interior point is known and no scale is extreme.
  bool IsMeasurable() const {
    return directions_ && extent_ >= kTripleProductMin && extent_ <= kTripleProductMax;
  }
  // Measures the surface anew when a map is worth that for `points` points to be looked up; where
  // it changed much since it was last measured, round a center and in a frame that suit its present
  // shape. fineness: the map has at most this many times the cells a side that suit points one by
  // one. True when it did; it does not where no interior point is known, or the poll, whose steps
  // are walks, said stop. Cost: at most `walks_per_point` walks for each point.
  bool MeasureBefore(const VertexTable& vertices, size_t points, double fineness,
                     double walks_per_point, StopPoll& poll);
  // False where the map rejected too few of the points looked up since it was measured.
  bool IsMapWorthwhile() const { return 8 * rejected_ >= asked_; }
  // Tells how many points were looked up in the map and how many it rejected: what it is worth.
  void CountRejected(size_t asked, size_t rejected) {
    asked_ += asked;
    rejected_ += rejected;
  }

  // Steps of all walks and scans, corners measured, and cells made, since this surface began: the
  // work of insertions beyond the triangles that they remove and create.
  uint64_t work() const { return work_; }
  // What it holds in memory. Cost: O(1).
  size_t MemoryBytes() const;

  // Calls visit(id, triangle) for every triangle.
  template <typename Visitor>
  void ForEachTriangle(Visitor&& visit) const {
    for (TriangleId id = 0; id < triangles_.size(); ++id) {
      if (IsAlive(id)) visit(id, triangles_[id]);
    }
  }
  const SurfaceTriangle& triangle(TriangleId id) const { return triangles_[id]; }
  // False for an ID that waits to be used again. Requires id < id_bound().
  bool IsAlive(TriangleId id) const {
    HULLD_DCHECK(id < id_bound());
    return triangles_[id].corners[0] != kDead;
  }
  // IDs of triangles lie below this.
  size_t id_bound() const { return triangles_.size(); }
  // What a plane's slope is relative to; infinite where the bound would not hold.
  double SizeWith(const VertexTable& vertices, const Vector& point) const {
    const double size = vertices.max_abs_coordinate() + LargestComponent(point);
    return size >= kPlaneMinCoordinate && size <= kPlaneMaxCoordinate ? size : INFINITY;
  }
  // Triangles that are alive, and IDs that wait to be used again.
  size_t triangle_count() const { return alive_; }
  size_t free_count() const { return free_.size(); }

 private:
  // Corrupts surfaces, to see that FindDefect notices.
  friend class SurfaceTestPeer;

  // An edge of the horizon, its triangle beyond, which edge it is there, and whether that triangle
  // is in a plane with the point. No member is of a character type, here and in Visit: a store to
  // one may change any object, so that the compiler would load all else again.
  struct HorizonEdge {
    VertexId tail;
    VertexId head;
    TriangleId beyond;
    uint16_t edge_beyond;
    bool is_flat;
  };
  // What the steps of a walk share: the point from the center, and what a triple product of it and
  // two vertices from the center errs by.
  struct Ray {
    Vector y;
    double bound;
  };
  // A triangle of the region under traversal, the edge to cross next, and how many are left.
  struct Visit {
    TriangleId triangle;
    uint16_t edge;
    uint16_t left;
  };
  // A map of directions in the making. Its corners are measured some at a time, so that no
  // insertion waits for all; as the polytope grows, what was measured early is low but not wrong.
  struct Measurement {
    DirectionMap map;
    // Where the direction leaves the surface: for the corners of the last row up to the one to
    // measure, and for those of the row before from there on.
    std::vector<TriangleId> hint;
    // The one that stood before in the last one's place.
    TriangleId hint_before = 0;
    // The corner to measure: its face, row and column.
    int face = 0;
    int i = 0;
    int j = 0;
    double least = INFINITY;
    double largest = 0;
  };

  // A dead triangle's first neighbour is one that came in its place.
  TriangleId Alive(TriangleId id) const {
    if (id >= triangles_.size()) return last_;
    while (!IsAlive(id)) id = triangles_[id].neighbours[0];
    return id;
  }
  // +1 when the point sees the triangle from outside, 0 when it lies in its plane.
  int SideOf(const VertexTable& vertices, TriangleId id, const Vector& point, double size) const {
    const SurfaceTriangle& t = triangles_[id];
    const double value = t.normal.dot(point) - t.offset;
    const double bound = static_cast<double>(t.slope) * size;
    if (value > bound) return 1;
    if (value < -bound) return -1;
    return ExactSideOf(vertices, t, point);
  }
  int ExactSideOf(const VertexTable& vertices, const SurfaceTriangle& t, const Vector& point) const;
  void SetTriangle(const VertexTable& vertices, TriangleId id, VertexId a, VertexId b, VertexId c);
  TriangleId NewId();
  void Link(TriangleId a, uint32_t edge_a, TriangleId b, uint32_t edge_b, bool is_flat);

  // The one among a triangle and those beyond its edges that the point is farthest outside; none
  // where doubles are not certain that it is outside any. Faster than the steps of a walk that it
  // saves.
  std::optional<Location> SeenNear(TriangleId id, const Vector& point, double size) const {
    const SurfaceTriangle& t = triangles_[id];
    TriangleId best = id;
    double most = HeightAbove(t, point, size);
    for (const TriangleId next : t.neighbours) {
      const double height = HeightAbove(triangles_[next], point, size);
      best = height > most ? next : best;
      most = std::max(most, height);
    }
    if (!(most > 0)) return std::nullopt;
    return Location{Side::kOutside, best};
  }
  // The point's height above the triangle's plane, times the length of its normal, where that is
  // certainly above zero; otherwise zero.
  static double HeightAbove(const SurfaceTriangle& t, const Vector& point, double size) {
    const double height = t.normal.dot(point) - t.offset;
    return height > static_cast<double>(t.slope) * size ? height : 0;
  }
  std::optional<Location> Walk(const VertexTable& vertices, const Vector& point, double size,
                               TriangleId start, uint64_t& steps) const;
  Ray RayTo(const Vector& point) const;
  size_t EdgeTowards(const VertexTable& vertices, const SurfaceTriangle& t, const Vector& point,
                     const Ray& ray, std::optional<uint32_t> first) const;
  double LeastTurn(const VertexTable& vertices, TriangleId id, const Vector& direction) const;
  Location Scan(const VertexTable& vertices, const Vector& point, double size) const;
  void Measure(const VertexTable& vertices);
  void Update(const VertexTable& vertices);
  bool IsWorthMeasuring() const;
  void SetCenter(const VertexTable& vertices);
  void StartMeasuring(int resolution);
  void ContinueMeasuring(const VertexTable& vertices, size_t corners);
  void MeasureCorner(const VertexTable& vertices);
  std::optional<Vector> FindInterior(const VertexTable& vertices) const;
  double Reach(const VertexTable& vertices, const Vector& direction, TriangleId& near);

  bool CollectCertainRegion(TriangleId first, const Vector& point, double size);
  void CollectRegion(const VertexTable& vertices, TriangleId first, const Vector& point,
                     double size);
  template <typename Classify>
  void Traverse(TriangleId first, Classify&& classify);
  bool CollectFlatStars(const VertexTable& vertices, const Vector& point, double size);
  bool IsFlatAround(const VertexTable& vertices, const HorizonEdge& before, const Vector& point,
                    double size);
  uint32_t NextMark();
  TriangleId MakeBase(const VertexTable& vertices, std::span<const VertexId> loop, size_t first,
                      size_t last);
  void KeepDirections();
  void InsertSurvivor(VertexTable& vertices, const Vector& point, size_t cell);
  void RemoveVertices(VertexTable& vertices);
  void JoinHorizon(const VertexTable& vertices, VertexId apex);
  void ResetMarks();

  static constexpr VertexId kDead = UINT32_MAX;
  static constexpr uint32_t kLastMark = (1u << 29) - 1;

  // What the journal keeps beside that of the triangles.
  struct Before {
    size_t alive;
    double extent;
    size_t next_update;
    size_t asked;
    size_t rejected;
    size_t measured_at;
    size_t joined;
    uint32_t mark;
    TriangleId last;
    bool was_measuring;
    // The map, once another has taken its place: it would reject too much.
    bool has_new_directions = false;
    std::optional<DirectionMap> directions;
  };

  ChunkedVector<SurfaceTriangle> triangles_;
  ChunkedVector<TriangleId> free_;
  size_t alive_ = 0;
  // By vertex: where in the horizon the edge is that leaves it, if it is on the horizon at all, as
  // that edge's tail tells; otherwise any number.
  ChunkedVector<uint32_t> place_of_vertex_;

  // Round a point strictly inside, when one is known: it stays so while the polytope grows.
  std::optional<DirectionMap> directions_;
  std::optional<Measurement> measuring_;
  // Largest distance, by components, of a vertex from that point.
  double extent_ = 0;
  // The count of triangles at which measuring the surface anew starts.
  size_t next_update_ = 0;
  // How many points were looked up in the map since the last measurement, and how many of them it
  // rejected.
  size_t asked_ = 0;
  size_t rejected_ = 0;
  // The count of triangles when it was last measured.
  size_t measured_at_ = 0;
  // Points joined since.
  size_t joined_ = 0;
  uint64_t work_ = 0;

  // What one insertion works with: the triangles that the point sees or whose planes hold it, their
  // boundary, and the stack of the traversal.
  ScratchList<TriangleId> region_;
  ScratchList<HorizonEdge> horizon_;
  ScratchList<Visit> visits_;
  // The triangles that go though the point does not see them.
  std::vector<TriangleId> flat_stars_;
  // The number of the traversal.
  uint32_t mark_ = 0;
  // See TakeSteps.
  uint64_t steps_ = 0;
  KeptBefore<Before> before_;
  // Where the last insertion was.
  TriangleId last_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_SURFACE_H_
