#ifndef HULLD_CORE_QUERY_PORTAL_SEARCH_H_
#define HULLD_CORE_QUERY_PORTAL_SEARCH_H_

#include <array>
#include <optional>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"

namespace hulld {

// Where the origin lies relative to a convex set C = A - B, by shooting a ray from a point inside C
// through the origin and looking for the facet of C through which it leaves.
//
// A portal is a triangle of vertices of C that the ray crosses. Its plane's far side is explored by
// the support vertex w along its normal n, pointing away from the centre: if n.w < 0, all of C is
// below the origin and n separates; if the portal itself lies beyond the origin, the origin is
// interior; if w is no farther than the portal, the plane supports C there and the origin, which is
// not below the plane, lies on it. Otherwise w replaces the corner of the portal that leaves the
// ray crossing it, and the crossing moves outwards.
//
// Ties: the centre c is taken to be c + (e, e^2, e^3) for an infinitesimal e, the ray's direction d
// = -c being kept. Then the ray crosses no edge, unless the edge is parallel to it; every
// refinement moves the crossing strictly outwards, so that with exact signs the search ends for
// every input. Source: Snethen 2008 (XenoCollide, Minkowski portal refinement) for portals;
// Edelsbrunner and Mücke 1990 (simulation of simplicity) for the ties.
enum class PortalVerdict { kSeparated, kTouching, kOverlapping, kStopped };

// Space stands for C. It offers
//
//   struct Point { IntegerVector w; ... };    a vertex of C
//   IntegerVector Center();                   a positive multiple of a point strictly inside C
//   Point Farthest(const IntegerVector& n);   a vertex farthest along n
//   bool MayContinue();                       false stops the search
template <typename Space>
class PortalSearch {
 public:
  using Point = typename Space::Point;

  struct Result {
    PortalVerdict verdict = PortalVerdict::kStopped;
    // Separated and touching: from A towards B, n.(a - b) <= 0 throughout.
    std::optional<IntegerVector> axis;
    // Touching: a triangle, possibly degenerate, that holds the origin.
    std::optional<std::array<Point, 3>> portal;
  };

  explicit PortalSearch(Space& space) : space_(space) {}

  Result Run() {
    center_ = space_.Center();
    ray_ = -center_;
    if (IsZero(ray_)) return {PortalVerdict::kOverlapping, {}, {}};
    if (std::optional<Result> early = FindPortal()) return *early;
    return RefinePortal();
  }

 private:
  // Explores along n; a result when that settles it.
  std::optional<Result> Explore(const IntegerVector& n, Point* farthest) {
    if (!space_.MayContinue()) return Result{};
    *farthest = space_.Farthest(n);
    if (Sign(Dot(n, farthest->w)) < 0) return Result{PortalVerdict::kSeparated, n, {}};
    return std::nullopt;
  }

  // Sign of det[d, p - c, q - c]: +1 when q is to the left of p seen along the ray. Ties as in the
  // comment above: the derivative by c is (p - q) x d. Zero only when p - q is parallel to the ray.
  int Turn(const Point& p, const Point& q) const {
    if (const int sign = Sign(Dot(ray_, Cross(p.w, q.w)))) return sign;
    const IntegerVector slope = Cross(p.w - q.w, ray_);
    for (int i = 0; i < 3; ++i) {
      if (const int sign = Sign(slope[i])) return sign;
    }
    return 0;
  }

  // Fills portal_ with a triangle that the ray's line crosses: a vertex p, one to the left and one
  // to the right of the plane through p and the ray, moved until their segment passes on the far
  // side of the ray from p.
  std::optional<Result> FindPortal() {
    auto& [p, left, right] = portal_;
    if (auto result = Explore(ray_, &p)) return result;
    IntegerVector n = Cross(ray_, p.w);
    if (IsZero(n)) {
      // p is on the ray's line; a vertex farthest along a direction across the ray is not.
      if (auto result = Explore(AnyPerpendicular(ray_), &p)) return result;
      n = Cross(ray_, p.w);
    }
    if (auto result = Explore(n, &left)) return result;
    if (auto result = Explore(-n, &right)) return result;
    while (Turn(left, right) < 0) {
      Point w;
      if (auto result = Explore(Cross(ray_, left.w - right.w), &w)) return result;
      (Turn(p, w) > 0 ? left : right) = w;
    }
    return std::nullopt;
  }

  Result RefinePortal() {
    auto& [p, q, r] = portal_;
    for (;;) {
      const IntegerVector n = Cross(q.w - p.w, r.w - p.w);
      if (Sign(Dot(n, p.w)) > 0) return {PortalVerdict::kOverlapping, {}, {}};
      Point w;
      if (auto result = Explore(n, &w)) return *result;
      if (Sign(Dot(n, w.w - p.w)) <= 0) {
        return {PortalVerdict::kTouching, n, portal_};
      }
      Replace(w);
    }
  }

  // Puts w in place of the corner that leaves the ray crossing the portal. Corners turn left in
  // order; exactly one consecutive pair has w to the right of the first and to the left of the
  // second, unless w is in line with a corner.
  void Replace(const Point& w) {
    int turn[3];
    for (int i = 0; i < 3; ++i) {
      turn[i] = Turn(portal_[i], w);
      if (turn[i] == 0) {
        portal_[i] = w;
        return;
      }
    }
    for (int i = 0; i < 3; ++i) {
      if (turn[i] < 0 && turn[(i + 1) % 3] > 0) {
        portal_[(i + 2) % 3] = w;
        return;
      }
    }
  }

  Space& space_;
  IntegerVector center_;
  IntegerVector ray_;
  std::array<Point, 3> portal_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PORTAL_SEARCH_H_
