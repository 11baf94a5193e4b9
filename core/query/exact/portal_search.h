#ifndef HULLD_CORE_QUERY_EXACT_PORTAL_SEARCH_H_
#define HULLD_CORE_QUERY_EXACT_PORTAL_SEARCH_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "core/base/stop_poll.h"
#include "core/numeric/vector.h"
#include "core/query/floating/float_search.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Finds the position of the origin relative to a convex set C of dimension 3. Shoots a ray from a
// point inside C through the origin and searches for the facet of C through which it leaves. C is A
// - B, or A - B thickened along given vectors.
//
// A portal is a triangle of vertices of C that the ray crosses. The search explores the far side of
// its plane by the support vertex w along its normal n, pointing away from the center. If n.w < 0,
// all of C is below the origin and n separates. If the portal itself lies beyond the origin, the
// origin is interior. If w is no farther than the portal, the plane supports C there and the
// origin, which is not below the plane, lies on it. Otherwise w replaces a corner of the portal so
// that the ray still crosses it, and the crossing moves outwards.
//
// Ties: the center c is taken to be c + (e, e^2, e^3) for an infinitesimal e, with the ray's
// direction d = -c unchanged. The ray then crosses no edge, unless the edge is parallel to it, and
// every refinement moves the crossing strictly outwards, so with exact signs the search terminates
// for every input. All signs are exact: floating point with a proven bound decides most, integers
// the rest. Source: Snethen 2008 (XenoCollide, Minkowski portal refinement) for portals;
// Edelsbrunner and Mücke 1990 (simulation of simplicity) for the ties.
//
// Pair is ExactPair or a WidePair: integers of any width or of a fixed one.
template <typename Pair>
class PortalSearch {
 public:
  using Number = typename Pair::Number;
  using Coordinates = typename Pair::Coordinates;
  using ExactDirection = typename Pair::Direction;

  // `pair` and `should_stop`, which may be empty, must outlive the search. Requires: C of dimension
  // 3 (unchecked: SearchExactly finds the dimension first).
  PortalSearch(Pair& pair, const std::function<bool()>& should_stop);

  // Thickens C: adds the segment from -half to half. May be called up to three times.
  void Thicken(const Coordinates& half);

  enum class Verdict { kSeparated, kTouching, kOverlapping, kStopped };
  struct Result {
    Verdict verdict = Verdict::kStopped;
    // Separated and touching: from A toward B, n.w <= 0 for all w in C.
    std::optional<ExactDirection> axis;
    // Touching: pairs for which the vertices of C are a triangle, possibly degenerate, that
    // contains the origin.
    std::optional<std::array<VertexPair, 3>> portal;
  };
  Result Run();

  // Tries to decide from the final state of a floating-point search by making its signs exact;
  // returns nothing if this does not suffice. Costs a fraction of Run, and works for a C of any
  // dimension that is not thickened.
  //
  // A direction along which nothing reaches the origin separates, regardless of its source. A
  // tetrahedron of vertices of C with the origin strictly inside proves an overlap. A corner equal
  // to the origin, or a face that contains it, proves that the origin is in C, and then a
  // supporting plane through the origin proves that it is on the boundary.
  std::optional<Result> TryEnd(const FloatSearchResult& end);

  uint64_t directions_tried() const { return directions_tried_; }

 private:
  // A vertex of C, or the center. In floating point within kMinkowskiErrorFactor of the pair's size
  // if there is a filter.
  struct Point {
    VertexPair pair = {};
    // The ends of C's thicknesses: bit i is set at the positive end of thickness i.
    unsigned sides = 0;
    Vector w = Vector::Zero();
    // Computed on demand.
    mutable std::optional<Coordinates> exact;
  };
  // The way in which a direction is constructed.
  enum class Kind {
    kRay,            // the ray's
    kAcrossPoint,    // ray x p
    kAcrossSegment,  // ray x (p - q)
    kNormal,         // (q - p) x (r - p)
    kOther,          // given
  };
  class Direction;

  const Coordinates& Exact(const Point& point) const;
  const Coordinates& ExactRay() const;
  int Sign3(const Point& p, const Point& q, const Point& r) const;
  int TurnOf(const Point& p, const Point& q) const;
  bool IsOnRay(const Point& p) const;
  int SignAlong(Direction& n, const Point& w) const;
  int SignOfAdvance(Direction& n, const Point& p, const Point& q, const Point& r,
                    const Point& w) const;
  Point Farthest(Direction& n);
  std::optional<Result> Explore(Direction& n, Point* farthest);
  std::optional<Result> Judge(Direction& n, const std::array<const Point*, 3>& holding);
  std::optional<Result> TryDirection(const Vector& direction, const Point& corner);
  std::optional<Result> TryTriangle(const Point& p, const Point& q, const Point& r,
                                    const Vector& along);
  std::optional<Result> TryTetrahedron(const std::array<Point, 4>& corners);
  std::optional<Result> FindPortal();
  Result RefinePortal();
  void Replace(const Point& w);

  Pair& pair_;
  StopPoll poll_;
  // True if floating point may decide.
  bool filtered_;
  // Error bound of a point's components, if filtered.
  double position_error_;
  std::array<Coordinates, 3> halves_;
  size_t half_count_ = 0;
  // From the center through the origin; the exact value is computed on demand.
  mutable std::optional<Coordinates> exact_ray_;
  Vector ray_ = Vector::Zero();
  std::array<Point, 3> portal_;
  uint64_t directions_tried_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_PORTAL_SEARCH_H_
