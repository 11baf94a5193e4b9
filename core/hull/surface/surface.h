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
#include "core/hull/surface/triangle_cones.h"
#include "core/hull/surface/vertex_table.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"

namespace hulld {

using TriangleId = uint32_t;

// A triangle of the surface, counter-clockwise seen from outside, in one cache line. neighbors[i]
// lies across the edge from corners[i] to corners[(i + 1) % 3]. The last corner is the apex: the
// triangle was created when that vertex was added, as one of a fan around it.
struct alignas(64) SurfaceTriangle {
  // The rounded plane: normal . p - offset errs by at most slope * (|p| + |corner|), |.| the
  // largest component. If the slope is 0, as for planes perpendicular to an axis, its sign is
  // exact.
  Vector normal;
  double offset;
  std::array<VertexId, 3> corners;
  std::array<TriangleId, 3> neighbors;
  float slope;
  // The last traversal with this triangle in its region.
  uint32_t mark : 29;
  // Bit i: the triangle beyond edge i is in the same plane. Known only if one of the two was joined
  // to the other across a horizon. For two triangles created together it is unknown, and the bit is
  // 0.
  uint32_t flat : 3;
};
static_assert(sizeof(SurfaceTriangle) == 64);

// The exact triangulated boundary of a growing convex polytope of dimension 3.
//
// To add a point that sees some triangle strictly from outside, Insert removes every triangle that
// it sees strictly, and joins the point to the horizon, the boundary of the removed region. If a
// triangle beyond the horizon lies in a plane with the point, the new triangle extends its facet,
// so a facet of many corners grows at one side and is unchanged elsewhere. That may leave a vertex
// that is no longer extreme: all of its remaining triangles lie in planes with the point. These
// triangles are removed as well. This keeps the vertex set minimal: a vertex stays extreme as long
// as some plane through it leaves the new point below. The removed region is a disk: the triangles
// that the point sees when moved inwards by an infinitesimal amount, and, in each facet that lies
// in a plane with the point, the triangles around consecutive corners. The point sees the remaining
// edges of these strictly from within that plane, because they are chords between remaining
// corners. Hence no new triangle is degenerate and no vertex of the horizon redundant.
//
// A walk on the surface finds the first triangle: toward the one that the ray from a fixed
// interior point through the new point pierces. A map of directions around that point rejects
// points that are certainly inside and supplies the start of the walk. Source: Clarkson and Shor
// 1989 for the incremental hull; Devillers, Pion and Teillaud 2002 for the walk.
class Surface {
 public:
  // Builds the cone from `apex` over a polygon, with the base triangulated so that a line crosses
  // few triangles. `polygon`: at least three vertices in order, in either orientation. Requires:
  // the polygon's plane does not contain the apex.
  Surface(const VertexTable& vertices, std::span<const VertexId> polygon, VertexId apex);

  // Adds a point. Cost: the triangles removed and created, and a walk of a few exact signs; a scan
  // of all triangles if no double lies strictly inside the polytope.
  void Insert(VertexTable& vertices, const Vector& point) {
    size_t cell = 0;
    if (directions_) {
      const DirectionMap::Place place = directions_->PlaceOf(point);
      ++tested_;
      if (directions_->IsCertainlyInside(place)) {
        ++rejected_;
        return;
      }
      cell = place.cell;
    }
    InsertSurvivor(vertices, point, cell);
  }

  // The location of a point, and a triangle that it sees strictly (outside) or with a cone that
  // contains it (inside). Below: inside, and strictly below the triangle's plane, so that the point
  // equals no vertex. Unknown: no triangle was found.
  enum class Side { kInside, kBelow, kOutside, kUnknown };
  struct Location {
    Side side;
    TriangleId triangle;
  };
  // Locates a point; fast if the last point located with these cones, or in the same cell of the
  // map, was near it. Unknown if the walk exceeds the length expected for the surface. cones: the
  // cones of the present surface, or null; without cones, no location is kBelow. Requires: a known
  // interior point.
  Location Locate(const VertexTable& vertices, const Vector& point, TriangleCones* cones) {
    HULLD_CHECK(directions_.has_value());
    if (cones != nullptr) return LocateByCones(vertices, point, *cones);
    const size_t cell = directions_->PlaceOf(point).cell;
    const double size = SizeWith(vertices, point);
    const TriangleId start = Alive(directions_->hint(cell));
    ++work_;
    Location location = SeenNear(start, point, size);
    if (location.side == Side::kUnknown) location = Walk(vertices, point, size, start, work_);
    if (location.side != Side::kUnknown) directions_->SetHint(cell, location.triangle);
    return location;
  }
  // Returns true if the point lies strictly outside the triangle's plane, exactly.
  bool IsSeenFrom(const VertexTable& vertices, TriangleId id, const Vector& point) const {
    return SideOf(vertices, id, point, SizeWith(vertices, point)) > 0;
  }
  // Returns true if floating point proves IsSeenFrom; false if it is uncertain.
  bool IsCertainlySeenFrom(const VertexTable& vertices, TriangleId id, const Vector& point) const {
    const SurfaceTriangle& t = triangles_[id];
    return t.normal.dot(point) - t.offset >
           static_cast<double>(t.slope) * SizeWith(vertices, point);
  }
  // Returns true if the point lies in the triangle's plane, exactly.
  bool IsInPlane(const VertexTable& vertices, TriangleId id, const Vector& point) const {
    return SideOf(vertices, id, point, SizeWith(vertices, point)) == 0;
  }
  // Add a point that sees the triangle `seen` strictly, in two steps. The first removes and returns
  // the triangles that the point sees and the triangles around removed vertices, so that the caller
  // can move its data by triangle. The second joins the point to their boundary and returns the new
  // triangles, which reuse IDs. The spans are valid until the next insertion. In builds without
  // NDEBUG the second step checks the new triangles (FindStarDefect).
  std::span<const TriangleId> RemoveVisible(VertexTable& vertices, const Vector& point,
                                            TriangleId seen);
  std::span<const TriangleId> JoinToBoundary(VertexTable& vertices, const Vector& point);
  // Returns the corner of the triangle that the point equals.
  std::optional<VertexId> CornerAt(const VertexTable& vertices, TriangleId id,
                                   const Vector& point) const;
  // Returns the insertion steps since the last call, for a poll: one for each insertion, and more
  // for insertions that change many triangles or search many for their place.
  uint64_t TakeSteps() { return std::exchange(steps_, 0); }
  // Call before many insertions. If the surface has doubled in size since the last measurement,
  // starts a new one.
  void BeginInsertions(const VertexTable& vertices);
  // Call after insertions by RemoveVisible and JoinToBoundary, which defer housekeeping to this
  // call.
  void FinishInsertions(const VertexTable& vertices);

  // Journal of changes: StartJournal starts it, Undo restores the state at its start except hints
  // for walks, EndJournal keeps the changes. Requires: no journal for StartJournal, a journal for
  // the other two. Cost: O(changes).
  void StartJournal();
  void Undo();
  void EndJournal();
  // Memory of the journal, in bytes.
  size_t JournalBytes() const;

  // The map of directions, for selecting and ordering insertions; null if no interior point is
  // known.
  const DirectionMap* directions() const { return directions_ ? &*directions_ : nullptr; }
  // True if an interior point is known and no magnitude is extreme.
  bool IsMeasurable() const {
    return directions_ && extent_ >= kTripleProductMin && extent_ <= kTripleProductMax;
  }
  // Remeasures the surface if this pays off for looking up `points` points in the map. If the
  // surface has changed much since the last measurement, the new map has a center and a frame that
  // fit its present shape. fineness: the map has at most this many times as many cells per side as
  // a map for single points. Returns true if it remeasured; false also if no interior point is
  // known or the poll stopped, with walks as its steps. Cost: at most `walks_per_point` walks for
  // each point. cones: may be null; walks are faster with them if the map has many more corners
  // than the surface has triangles.
  bool MeasureBefore(const VertexTable& vertices, size_t points, double fineness,
                     double walks_per_point, StopPoll& poll, TriangleCones* cones);
  // Returns false if the map rejected too few of the points looked up since the last measurement.
  bool IsMapWorthwhile() const { return 8 * rejected_ >= tested_; }
  // Records the number of points looked up in the map and rejected by it, as a measure of its
  // value.
  void CountRejected(size_t tested, size_t rejected) {
    tested_ += tested;
    rejected_ += rejected;
  }

  // Number of walk and scan steps, measured corners, and created cells over the surface's lifetime:
  // the work of insertions beyond the triangles removed and created.
  uint64_t work() const { return work_; }
  // Memory, in bytes. Cost: O(1).
  size_t MemoryBytes() const;

  // Calls visit(id, triangle) for every triangle.
  template <typename Visitor>
  void ForEachTriangle(Visitor&& visit) const {
    for (TriangleId id = 0; id < triangles_.size(); ++id) {
      if (IsAlive(id)) visit(id, triangles_[id]);
    }
  }
  const SurfaceTriangle& triangle(TriangleId id) const { return triangles_[id]; }
  // False for a free ID. Requires: id < id_bound().
  bool IsAlive(TriangleId id) const {
    HULLD_DCHECK(id < id_bound());
    return triangles_[id].corners[0] != kDead;
  }
  // All triangle IDs are below this.
  size_t id_bound() const { return triangles_.size(); }
  // Returns the factor of a plane's slope in its error bound; infinite if the bound would not hold.
  double SizeWith(const VertexTable& vertices, const Vector& point) const {
    const double size = vertices.max_abs_coordinate() + LargestComponent(point);
    return size >= kPlaneMinCoordinate && size <= kPlaneMaxCoordinate ? size : INFINITY;
  }
  // Numbers of live triangles and of free IDs.
  size_t triangle_count() const { return alive_; }
  size_t free_count() const { return free_.size(); }

 private:
  // Corrupts surfaces to test FindDefect.
  friend class SurfaceTestPeer;

  // An edge of the horizon, the triangle beyond it, the edge's index there, and a flag for a
  // triangle in a plane with the point. No member, here and in Visit, has a character type: a store
  // to one may alias any object, so the compiler would reload everything else.
  struct HorizonEdge {
    VertexId tail;
    VertexId head;
    TriangleId beyond;
    uint16_t edge_beyond;
    bool is_flat;
  };
  // Data shared by the steps of a walk: the point relative to the center, and the error bound of a
  // triple product of it and two vertices relative to the center.
  struct Ray {
    Vector y;
    double bound;
  };
  // A triangle of the traversed region, the edge to cross next, and the number of edges left.
  struct Visit {
    TriangleId triangle;
    uint16_t edge;
    uint16_t left;
  };
  // A map of directions under construction. Each insertion measures some corners, so that none pays
  // for all. As the polytope grows, early measurements are low but not wrong.
  struct Measurement {
    DirectionMap map;
    // Triangles at which the corners' directions leave the surface: of the current row before the
    // current corner, and of the previous row from there on.
    std::vector<TriangleId> hint;
    // The previous value of the last entry.
    TriangleId hint_before = 0;
    // The corner to measure: its face, row and column.
    int face = 0;
    int i = 0;
    int j = 0;
    double least = INFINITY;
    double largest = 0;
  };

  // Follows dead triangles: a dead triangle's first neighbor is one that replaced it.
  TriangleId Alive(TriangleId id) const {
    if (id >= triangles_.size()) return last_;
    while (!IsAlive(id)) id = triangles_[id].neighbors[0];
    return id;
  }
  // Returns +1 if the point sees the triangle from outside, 0 if it lies in its plane.
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

  // Returns the triangle that the point is farthest outside of, among a triangle and the triangles
  // beyond its edges; unknown if doubles do not prove that it is outside any of them. Faster than
  // the walk steps that it saves.
  Location SeenNear(TriangleId id, const Vector& point, double size) const {
    const SurfaceTriangle& t = triangles_[id];
    TriangleId best = id;
    double largest = HeightAbove(t, point, size);
    for (const TriangleId next : t.neighbors) {
      const double height = HeightAbove(triangles_[next], point, size);
      best = height > largest ? next : best;
      largest = std::max(largest, height);
    }
    return {largest > 0 ? Side::kOutside : Side::kUnknown, best};
  }
  // Returns the point's height above the triangle's plane, times the length of its normal, if that
  // is certainly above zero; otherwise zero.
  static double HeightAbove(const SurfaceTriangle& t, const Vector& point, double size) {
    const double height = t.normal.dot(point) - t.offset;
    return height > static_cast<double>(t.slope) * size ? height : 0;
  }
  Location Walk(const VertexTable& vertices, const Vector& point, double size, TriangleId start,
                uint64_t& steps) const;
  TriangleCones::Cone ConeOf(const VertexTable& vertices, TriangleId id) const;
  Location LocateByCones(const VertexTable& vertices, const Vector& point, TriangleCones& cones);
  Location WalkByCones(const VertexTable& vertices, const Vector& point, double size,
                       TriangleId start, TriangleCones& cones);
  Ray RayTo(const Vector& point) const;
  size_t EdgeToward(const VertexTable& vertices, const SurfaceTriangle& t, const Vector& point,
                    const Ray& ray, std::optional<uint32_t> first) const;
  double MinTurn(const VertexTable& vertices, TriangleId id, const Vector& direction) const;
  Location Scan(const VertexTable& vertices, const Vector& point, double size) const;
  void Measure(const VertexTable& vertices);
  void Update(const VertexTable& vertices);
  bool IsWorthMeasuring() const;
  void SetCenter(const VertexTable& vertices);
  void StartMeasuring(int resolution);
  void ContinueMeasuring(const VertexTable& vertices, size_t corners, TriangleCones* cones);
  void MeasureCorner(const VertexTable& vertices, TriangleCones* cones);
  std::optional<Vector> FindInterior(const VertexTable& vertices) const;
  double Reach(const VertexTable& vertices, const Vector& direction, TriangleId& near,
               TriangleCones* cones);

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

  // Journal data in addition to the journal of the triangles.
  struct Before {
    size_t alive;
    double extent;
    size_t next_update;
    size_t tested;
    size_t rejected;
    size_t measured_at;
    size_t joined;
    uint32_t mark;
    TriangleId last;
    bool was_measuring;
    // The map that was replaced: the new map would reject too much after an undo.
    bool has_new_directions = false;
    std::optional<DirectionMap> directions;
  };

  ChunkedVector<SurfaceTriangle> triangles_;
  ChunkedVector<TriangleId> free_;
  size_t alive_ = 0;
  // By vertex: the index in the horizon of the edge that leaves it. Valid only if that edge's tail
  // is the vertex; otherwise arbitrary.
  ChunkedVector<uint32_t> place_of_vertex_;

  // The map around a point strictly inside, if such a point is known. The point stays inside while
  // the polytope grows.
  std::optional<DirectionMap> directions_;
  std::optional<Measurement> measuring_;
  // Largest distance, by components, of a vertex from that point.
  double extent_ = 0;
  // Number of triangles at which the surface is remeasured.
  size_t next_update_ = 0;
  // Number of points looked up in the map since the last measurement, and number of these that it
  // rejected.
  size_t tested_ = 0;
  size_t rejected_ = 0;
  // Number of triangles at the last measurement.
  size_t measured_at_ = 0;
  // Points joined since then.
  size_t joined_ = 0;
  uint64_t work_ = 0;

  // Scratch for an insertion: the triangles that the point sees or that have it in their planes,
  // their boundary, and the stack of the traversal.
  ScratchList<TriangleId> region_;
  ScratchList<HorizonEdge> horizon_;
  ScratchList<Visit> visits_;
  // Removed triangles that the point does not see.
  std::vector<TriangleId> flat_stars_;
  // Number of the current traversal.
  uint32_t mark_ = 0;
  // See TakeSteps.
  uint64_t steps_ = 0;
  KeptBefore<Before> before_;
  // Location of the last insertion.
  TriangleId last_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_SURFACE_H_
