#include "core/query/exact/portal_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/exact/wide_pair.h"

namespace hulld {
namespace {

double LargestOf(const Vector& v) { return v.cwiseAbs().maxCoeff(); }

double LargestOf(const Vector& u, const Vector& v, const Vector& w) {
  return u.cwiseAbs().cwiseMax(v.cwiseAbs()).cwiseMax(w.cwiseAbs()).maxCoeff();
}

// Returns the sign of `value` if it exceeds `bound`, otherwise nothing.
std::optional<int> CertainSign(double value, double bound) {
  if (value > bound) return 1;
  if (value < -bound) return -1;
  return std::nullopt;
}

}  // namespace

// A direction in floating point, if filtered, and exactly on demand.
template <typename Pair>
class PortalSearch<Pair>::Direction {
 public:
  Direction(const PortalSearch& search, Kind kind, const Point* p = nullptr,
            const Point* q = nullptr, const Point* r = nullptr)
      : search_(search), kind_(kind), p_(p), q_(q), r_(r) {
    if (!search.filtered_) return;
    const auto cross = [&](const Vector& u, const Vector& v) {
      n_ = u.cross(v);
      error_ = kNormalErrorFactor * search.position_error_ *
               (LargestOf(u) + LargestOf(v) + 3 * search.position_error_);
    };
    switch (kind) {
      case Kind::kRay:
        n_ = search.ray_;
        error_ = search.position_error_;
        break;
      case Kind::kAcrossPoint:
        cross(search.ray_, p->w);
        break;
      case Kind::kAcrossSegment:
        cross(search.ray_, p->w - q->w);
        break;
      case Kind::kNormal:
        cross(q->w - p->w, r->w - p->w);
        break;
      case Kind::kOther:
        break;
    }
  }
  // Requires: n not zero.
  Direction(const PortalSearch& search, ExactDirection n)
      : search_(search), kind_(Kind::kOther), exact_(std::move(n)) {
    if (!search.filtered_) return;
    n_ = ToScaledDoubles(ToInteger(*exact_));
    error_ = kScaledDoublesError * LargestOf(n_);
  }

  // Requires: filtered, and n not zero, of integers below 2^62.
  Direction(const PortalSearch& search, const Vector& n)
      : search_(search), kind_(Kind::kOther), n_(n) {
    exact_ = ExactDirection{static_cast<int64_t>(n.x()), static_cast<int64_t>(n.y()),
                            static_cast<int64_t>(n.z())};
  }

  void Negate() {
    n_ = -n_;
    negated_ = !negated_;
    if (exact_) exact_ = -*exact_;
  }

  Kind kind() const { return kind_; }
  bool negated() const { return negated_; }
  const Point& p() const { return *p_; }
  const Point& q() const { return *q_; }
  const Point& r() const { return *r_; }
  // If filtered: each component within error() of the exact one.
  const Vector& n() const { return n_; }
  double error() const { return error_; }

  const ExactDirection& exact() {
    if (!exact_) {
      exact_ = Compute();
      if (negated_) exact_ = -*exact_;
    }
    return *exact_;
  }

 private:
  ExactDirection Compute() const {
    switch (kind_) {
      case Kind::kAcrossPoint:
        return Cross(search_.ExactRay(), search_.Exact(*p_));
      case Kind::kAcrossSegment:
        return Cross(search_.ExactRay(), Coordinates(search_.Exact(*p_) - search_.Exact(*q_)));
      case Kind::kNormal: {
        const Coordinates& origin = search_.Exact(*p_);
        return Cross(Coordinates(search_.Exact(*q_) - origin),
                     Coordinates(search_.Exact(*r_) - origin));
      }
      case Kind::kRay:
        return Pair::ToDirection(search_.ExactRay());
      case Kind::kOther:
        break;
    }
    // A given direction is exact from the start.
    HULLD_UNREACHABLE();
  }

  const PortalSearch& search_;
  const Kind kind_;
  const Point* const p_ = nullptr;
  const Point* const q_ = nullptr;
  const Point* const r_ = nullptr;
  Vector n_ = Vector::Zero();
  double error_ = 0;
  bool negated_ = false;
  std::optional<ExactDirection> exact_;
};

template <typename Pair>
PortalSearch<Pair>::PortalSearch(Pair& pair, const std::function<bool()>& should_stop)
    : pair_(pair),
      poll_(should_stop, 1),
      filtered_(pair.filter().usable()),
      position_error_(kMinkowskiErrorFactor * pair.filter().size()) {}

template <typename Pair>
void PortalSearch<Pair>::Thicken(const Coordinates& half) {
  halves_[half_count_++] = half;
  filtered_ = false;
}

template <typename Pair>
const typename Pair::Coordinates& PortalSearch<Pair>::Exact(const Point& point) const {
  if (!point.exact) {
    point.exact = pair_.Difference(point.pair);
    for (size_t i = 0; i < half_count_; ++i) {
      Coordinates& w = *point.exact;
      w = (point.sides >> i & 1) != 0 ? w + halves_[i] : w - halves_[i];
    }
  }
  return *point.exact;
}

template <typename Pair>
const typename Pair::Coordinates& PortalSearch<Pair>::ExactRay() const {
  if (!exact_ray_) exact_ray_ = -pair_.CenterDifference();
  return *exact_ray_;
}

// Returns the sign of det[p, q, r].
template <typename Pair>
int PortalSearch<Pair>::Sign3(const Point& p, const Point& q, const Point& r) const {
  if (filtered_) {
    const double largest = LargestOf(p.w, q.w, r.w);
    const double bound = kTetrahedronErrorFactor * largest * largest * position_error_;
    if (const auto sign = CertainSign(p.w.dot(q.w.cross(r.w)), bound)) return *sign;
  }
  return Sign(Dot(Cross(Exact(q), Exact(r)), Exact(p)));
}

// Returns the sign of det[d, p - c, q - c]: +1 if q is to the left of p seen along the ray. Ties
// are broken as in the class comment: the derivative by c is (p - q) x d. Zero only if p - q is
// parallel to the ray.
template <typename Pair>
int PortalSearch<Pair>::TurnOf(const Point& p, const Point& q) const {
  if (filtered_) {
    const double largest = LargestOf(ray_, p.w, q.w);
    const double bound = kTetrahedronErrorFactor * largest * largest * position_error_;
    if (const auto sign = CertainSign(ray_.dot(p.w.cross(q.w)), bound)) return *sign;
  }
  const Coordinates& exact_p = Exact(p);
  const Coordinates& exact_q = Exact(q);
  if (const int sign = Sign(Dot(Cross(exact_p, exact_q), ExactRay()))) return sign;
  const ExactDirection slope = Cross(Coordinates(exact_p - exact_q), ExactRay());
  for (int i = 0; i < 3; ++i) {
    if (const int sign = Sign(slope[i])) return sign;
  }
  return 0;
}

// Returns true if ray x p = 0.
template <typename Pair>
bool PortalSearch<Pair>::IsOnRay(const Point& p) const {
  if (filtered_) {
    const double sizes = LargestOf(ray_) + LargestOf(p.w) + 3 * position_error_;
    const double bound = kNormalErrorFactor * position_error_ * sizes;
    if (LargestOf(ray_.cross(p.w)) > bound) return false;
  }
  return IsZero(Cross(ExactRay(), Exact(p)));
}

// Returns the sign of n.w.
template <typename Pair>
int PortalSearch<Pair>::SignAlong(Direction& n, const Point& w) const {
  if (filtered_ && n.kind() == Kind::kRay && !n.negated()) {
    const double largest = std::max(LargestOf(ray_), LargestOf(w.w));
    const double bound = kRayErrorFactor * largest * position_error_;
    if (const auto sign = CertainSign(ray_.dot(w.w), bound)) return *sign;
  } else if (filtered_ && n.kind() != Kind::kOther) {
    // A determinant of w and two differences of points.
    Vector u = ray_;
    Vector v = Vector::Zero();
    switch (n.kind()) {
      case Kind::kAcrossPoint:
        v = n.p().w;
        break;
      case Kind::kAcrossSegment:
        v = n.p().w - n.q().w;
        break;
      case Kind::kNormal:
        u = n.q().w - n.p().w;
        v = n.r().w - n.p().w;
        break;
      case Kind::kRay:
        break;
      case Kind::kOther:
        HULLD_UNREACHABLE();
    }
    const double largest = LargestOf(u, v, w.w);
    const double bound = kDifferencesErrorFactor * largest * largest * position_error_;
    const double value = w.w.dot(u.cross(v));
    if (const auto sign = CertainSign(n.negated() ? -value : value, bound)) return *sign;
  }
  return Sign(Dot(n.exact(), Exact(w)));
}

// Returns the sign of n.(w - p) for the normal n of the portal p, q, r.
template <typename Pair>
int PortalSearch<Pair>::SignOfAdvance(Direction& n, const Point& p, const Point& q, const Point& r,
                                      const Point& w) const {
  if (filtered_) {
    const Vector u = q.w - p.w;
    const Vector v = r.w - p.w;
    const Vector x = w.w - p.w;
    const double largest = LargestOf(u, v, x);
    const double bound = kDifferencesErrorFactor * largest * largest * position_error_;
    if (const auto sign = CertainSign(x.dot(u.cross(v)), bound)) return *sign;
  }
  return Sign(Dot(n.exact(), Coordinates(Exact(w) - Exact(p))));
}

// Floating point leaves few candidates, usually a single one. If there are several, exact values
// decide.
template <typename Pair>
typename PortalSearch<Pair>::Point PortalSearch<Pair>::Farthest(Direction& n) {
  ++directions_tried_;
  Point point;
  if (filtered_) {
    const FloatPair& filter = pair_.filter();
    CandidateBuffer buffer;
    const auto a = filter.CandidatesA(n.n(), n.error(), buffer);
    point.pair.a = a.size() == 1 ? a[0] : pair_.FarthestA(n.exact(), a);
    const auto b = filter.CandidatesB(n.n(), n.error(), buffer);
    point.pair.b = b.size() == 1 ? b[0] : pair_.FarthestB(n.exact(), b);
  } else {
    point.pair = {pair_.FarthestA(n.exact()), pair_.FarthestB(n.exact())};
  }
  for (size_t i = 0; i < half_count_; ++i) {
    if (Sign(Dot(n.exact(), halves_[i])) >= 0) point.sides |= 1u << i;
  }
  if (filtered_) point.w = pair_.filter().Difference(point.pair);
  return point;
}

// Explores along n. Returns a result if that decides the relation.
template <typename Pair>
std::optional<typename PortalSearch<Pair>::Result> PortalSearch<Pair>::Explore(Direction& n,
                                                                               Point* farthest) {
  if (poll_.Step()) return Result{};
  *farthest = Farthest(n);
  if (pair_.stopped()) return Result{};
  if (SignAlong(n, *farthest) < 0) return Result{Verdict::kSeparated, n.exact(), {}};
  return std::nullopt;
}

template <typename Pair>
typename PortalSearch<Pair>::Result PortalSearch<Pair>::Run() {
  if (filtered_) ray_ = -pair_.filter().InnerDifference();
  const bool is_certain = filtered_ && LargestOf(ray_) > position_error_;
  if (!is_certain && IsZero(ExactRay())) return {Verdict::kOverlapping, {}, {}};
  if (std::optional<Result> early = FindPortal()) return *std::move(early);
  return RefinePortal();
}

template <typename Pair>
std::optional<typename PortalSearch<Pair>::Result> PortalSearch<Pair>::TryEnd(
    const FloatSearchResult& end) {
  HULLD_DCHECK(half_count_ == 0);
  if (!filtered_ || end.pair_count == 0) return std::nullopt;
  if (poll_.Step()) return Result{};
  std::array<Point, 4> corners;
  for (uint32_t i = 0; i < end.pair_count; ++i) {
    corners[i].pair = end.pairs[i];
    corners[i].w = pair_.filter().Difference(end.pairs[i]);
  }
  switch (end.pair_count) {
    case 1:
      return TryDirection(end.axis, corners[0]);
    case 3:
      return TryTriangle(corners[0], corners[1], corners[2], end.axis);
    case 4:
      return TryTetrahedron(corners);
    default:
      return std::nullopt;
  }
}

// Returns the result if no vertex is beyond the origin along n. `holding`: corners with a hull that
// contains the origin, if known.
template <typename Pair>
std::optional<typename PortalSearch<Pair>::Result> PortalSearch<Pair>::Judge(
    Direction& n, const std::array<const Point*, 3>& holding) {
  const Point w = Farthest(n);
  if (pair_.stopped()) return Result{};
  const int side = SignAlong(n, w);
  if (side < 0) return Result{Verdict::kSeparated, n.exact(), {}};
  if (side > 0 || holding[0] == nullptr) return std::nullopt;
  return Result{
      Verdict::kTouching, n.exact(), {{holding[0]->pair, holding[1]->pair, holding[2]->pair}}};
}

template <typename Pair>
std::optional<typename PortalSearch<Pair>::Result> PortalSearch<Pair>::TryDirection(
    const Vector& direction, const Point& corner) {
  const double largest = LargestOf(direction);
  if (!(largest > 0)) return std::nullopt;
  // Rounds to few bits, so that a direction close to an axis becomes that axis. The direction need
  // not be exact: if the corner is the only contact, a cone of directions supports C there.
  const Vector n = (direction * std::ldexp(1.0, 30 - std::ilogb(largest))).array().round();
  Direction rounded(*this, n);
  const Point* const holding = IsZero(Exact(corner)) ? &corner : nullptr;
  return Judge(rounded, {holding, holding, holding});
}

template <typename Pair>
std::optional<typename PortalSearch<Pair>::Result> PortalSearch<Pair>::TryTriangle(
    const Point& p, const Point& q, const Point& r, const Vector& along) {
  Direction n(*this, Kind::kNormal, &p, &q, &r);
  if (n.n().dot(along) < 0) n.Negate();
  const ExactDirection& normal = n.exact();
  if (IsZero(normal)) return std::nullopt;
  bool holds = Sign3(p, q, r) == 0;
  if (holds) {
    // The origin's coordinates in the triangle are products parallel to the normal, so a component
    // in which the normal is not zero gives their signs.
    int axis = 0;
    while (normal[axis].is_zero()) ++axis;
    int min = 1;
    int max = -1;
    for (const auto& [u, v] : {std::pair{&q, &r}, {&r, &p}, {&p, &q}}) {
      const int sign = Sign(Cross(Exact(*u), Exact(*v))[axis]);
      min = std::min(min, sign);
      max = std::max(max, sign);
    }
    holds = min >= 0 || max <= 0;
  }
  return Judge(n, holds ? std::array{&p, &q, &r} : std::array<const Point*, 3>{});
}

template <typename Pair>
std::optional<typename PortalSearch<Pair>::Result> PortalSearch<Pair>::TryTetrahedron(
    const std::array<Point, 4>& corners) {
  const auto& [p, q, r, s] = corners;
  // The origin's coordinates: the weight of each corner, up to a common factor.
  const int weights[4] = {-Sign3(r, s, q), Sign3(r, s, p), -Sign3(p, q, s), Sign3(p, q, r)};
  const auto [min, max] = std::minmax_element(weights, weights + 4);
  if (*min * *max > 0) return Result{Verdict::kOverlapping, {}, {}};
  // Outside, or flat.
  if (*min == *max || (*min < 0 && *max > 0)) return std::nullopt;
  for (int i = 0; i < 4; ++i) {
    if (weights[i] != 0) continue;
    // The origin is on the face opposite to corner i.
    const std::array<const Point*, 3> face = {&corners[(i + 1) % 4], &corners[(i + 2) % 4],
                                              &corners[(i + 3) % 4]};
    Direction n(*this, Kind::kNormal, face[0], face[1], face[2]);
    if (SignAlong(n, corners[i]) > 0) n.Negate();
    if (std::optional<Result> result = Judge(n, face)) return result;
  }
  return std::nullopt;
}

// Fills portal_ with a triangle that the ray's line crosses: a vertex p, one to the left and one to
// the right of the plane through p and the ray, moved until their segment passes on the far side of
// the ray from p.
template <typename Pair>
std::optional<typename PortalSearch<Pair>::Result> PortalSearch<Pair>::FindPortal() {
  auto& [p, left, right] = portal_;
  Direction along(*this, Kind::kRay);
  if (auto result = Explore(along, &p)) return result;
  if (IsOnRay(p)) {
    // p is on the ray's line; a vertex farthest along a direction perpendicular to the ray is not.
    Direction across(*this, Pair::ToDirection(AnyPerpendicular(ExactRay())));
    if (auto result = Explore(across, &p)) return result;
  }
  Direction aside(*this, Kind::kAcrossPoint, &p);
  if (auto result = Explore(aside, &left)) return result;
  aside.Negate();
  if (auto result = Explore(aside, &right)) return result;
  while (TurnOf(left, right) < 0) {
    Point w;
    Direction n(*this, Kind::kAcrossSegment, &left, &right);
    if (auto result = Explore(n, &w)) return result;
    (TurnOf(p, w) > 0 ? left : right) = w;
  }
  return std::nullopt;
}

template <typename Pair>
typename PortalSearch<Pair>::Result PortalSearch<Pair>::RefinePortal() {
  auto& [p, q, r] = portal_;
  for (;;) {
    // n.p: the triple product is the same for edges and for points.
    const int side = Sign3(p, q, r);
    if (side > 0) return {Verdict::kOverlapping, {}, {}};
    Point w;
    Direction n(*this, Kind::kNormal, &p, &q, &r);
    if (poll_.Step()) return {};
    w = Farthest(n);
    if (pair_.stopped()) return {};
    const bool is_corner = std::any_of(portal_.begin(), portal_.end(), [&](const Point& corner) {
      return corner.pair == w.pair && corner.sides == w.sides;
    });
    if ((is_corner ? side : SignAlong(n, w)) < 0) return {Verdict::kSeparated, n.exact(), {}};
    if (is_corner || SignOfAdvance(n, p, q, r, w) <= 0) {
      return {Verdict::kTouching, n.exact(), {{p.pair, q.pair, r.pair}}};
    }
    Replace(w);
  }
}

// Replaces a corner by w so that the ray still crosses the portal. Corners are in counter-clockwise
// order; exactly one consecutive pair has w to the right of the first and to the left of the
// second, unless w is in line with a corner.
template <typename Pair>
void PortalSearch<Pair>::Replace(const Point& w) {
  int turn[3];
  for (int i = 0; i < 3; ++i) {
    turn[i] = TurnOf(portal_[i], w);
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
  HULLD_UNREACHABLE();
}

template class PortalSearch<ExactPair>;
template class PortalSearch<WidePair<1>>;
template class PortalSearch<WidePair<2>>;
template class PortalSearch<WidePair<3>>;
template class PortalSearch<WidePair<5>>;

}  // namespace hulld
