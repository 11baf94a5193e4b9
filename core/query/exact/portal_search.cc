#include "core/query/exact/portal_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"

namespace hulld {
namespace {

double LargestOf(const Vector& v) { return v.cwiseAbs().maxCoeff(); }

double LargestOf(const Vector& u, const Vector& v, const Vector& w) {
  return u.cwiseAbs().cwiseMax(v.cwiseAbs()).cwiseMax(w.cwiseAbs()).maxCoeff();
}

// Sign of `value` where it exceeds `bound`, else nothing.
std::optional<int> CertainSign(double value, double bound) {
  if (value > bound) return 1;
  if (value < -bound) return -1;
  return std::nullopt;
}

}  // namespace

// A direction in floating point, where filtered, and exactly once it is asked for.
class PortalSearch::Direction {
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
  Direction(const PortalSearch& search, IntegerVector n)
      : search_(search), kind_(Kind::kOther), exact_(std::move(n)) {}

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
  // Where filtered and not kOther: each component within error() of the exact one.
  const Vector& n() const { return n_; }
  double error() const { return error_; }

  const IntegerVector& exact() {
    if (!exact_) {
      exact_ = Compute();
      if (negated_) exact_ = -*exact_;
    }
    return *exact_;
  }

 private:
  IntegerVector Compute() const {
    switch (kind_) {
      case Kind::kAcrossPoint:
        return Cross(search_.ExactRay(), search_.Exact(*p_));
      case Kind::kAcrossSegment:
        return Cross(search_.ExactRay(), search_.Exact(*p_) - search_.Exact(*q_));
      case Kind::kNormal: {
        const IntegerVector origin = search_.Exact(*p_);
        return Cross(search_.Exact(*q_) - origin, search_.Exact(*r_) - origin);
      }
      case Kind::kRay:
        return search_.ExactRay();
      case Kind::kOther:
        break;
    }
    // A direction that was given is exact from the start.
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
  std::optional<IntegerVector> exact_;
};

PortalSearch::PortalSearch(ExactPair& pair, const std::function<bool()>& should_stop)
    : pair_(pair),
      poll_(should_stop, 1),
      filtered_(pair.filter().usable()),
      position_error_(kMinkowskiErrorFactor * pair.filter().size()) {}

void PortalSearch::Thicken(int axis, Integer half) {
  axis_ = axis;
  half_ = std::move(half);
  filtered_ = false;
}

IntegerVector PortalSearch::Exact(const Point& point) const {
  IntegerVector w = pair_.Corner(point.pair).w;
  if (axis_ >= 0) w[axis_] += point.side < 0 ? Integer(-half_) : half_;
  return w;
}

const IntegerVector& PortalSearch::ExactRay() const {
  if (!exact_ray_) exact_ray_ = -pair_.CenterDifference();
  return *exact_ray_;
}

// Sign of det[p, q, r].
int PortalSearch::Sign3(const Point& p, const Point& q, const Point& r) const {
  if (filtered_) {
    const double largest = LargestOf(p.w, q.w, r.w);
    const double bound = kTetrahedronErrorFactor * largest * largest * position_error_;
    if (const auto sign = CertainSign(p.w.dot(q.w.cross(r.w)), bound)) return *sign;
  }
  return Sign(Dot(Exact(p), Cross(Exact(q), Exact(r))));
}

// Sign of det[d, p - c, q - c]: +1 when q is to the left of p seen along the ray. Ties as in the
// class comment: the derivative by c is (p - q) x d. Zero only when p - q is parallel to the ray.
int PortalSearch::TurnOf(const Point& p, const Point& q) const {
  if (filtered_) {
    const double largest = LargestOf(ray_, p.w, q.w);
    const double bound = kTetrahedronErrorFactor * largest * largest * position_error_;
    if (const auto sign = CertainSign(ray_.dot(p.w.cross(q.w)), bound)) return *sign;
  }
  const IntegerVector exact_p = Exact(p);
  const IntegerVector exact_q = Exact(q);
  if (const int sign = Sign(Dot(ExactRay(), Cross(exact_p, exact_q)))) return sign;
  const IntegerVector slope = Cross(exact_p - exact_q, ExactRay());
  for (int i = 0; i < 3; ++i) {
    if (const int sign = Sign(slope[i])) return sign;
  }
  return 0;
}

// Whether ray x p = 0.
bool PortalSearch::IsOnRay(const Point& p) const {
  if (filtered_) {
    const double sizes = LargestOf(ray_) + LargestOf(p.w) + 3 * position_error_;
    const double bound = kNormalErrorFactor * position_error_ * sizes;
    if (LargestOf(ray_.cross(p.w)) > bound) return false;
  }
  return IsZero(Cross(ExactRay(), Exact(p)));
}

// Sign of n.w.
int PortalSearch::SignAlong(Direction& n, const Point& w) const {
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

// Sign of n.(w - p) for the normal n of the portal p, q, r.
int PortalSearch::SignOfAdvance(Direction& n, const Point& p, const Point& q, const Point& r,
                                const Point& w) const {
  if (filtered_) {
    const Vector u = q.w - p.w;
    const Vector v = r.w - p.w;
    const Vector x = w.w - p.w;
    const double largest = LargestOf(u, v, x);
    const double bound = kDifferencesErrorFactor * largest * largest * position_error_;
    if (const auto sign = CertainSign(x.dot(u.cross(v)), bound)) return *sign;
  }
  return Sign(Dot(n.exact(), Exact(w) - Exact(p)));
}

// Floating point leaves few candidates, mostly one; among several exact values decide.
PortalSearch::Point PortalSearch::Farthest(Direction& n) {
  ++directions_tried_;
  Point point;
  if (filtered_ && n.kind() != Kind::kOther) {
    const FloatPair& filter = pair_.filter();
    const std::vector<uint32_t> a = filter.CandidatesA(n.n(), n.error());
    const std::vector<uint32_t> b = filter.CandidatesB(n.n(), n.error());
    point.pair.a = a.size() == 1 ? a[0] : pair_.FarthestA(n.exact(), a);
    point.pair.b = b.size() == 1 ? b[0] : pair_.FarthestB(n.exact(), b);
  } else {
    point.pair = {pair_.FarthestA(n.exact()), pair_.FarthestB(n.exact())};
  }
  if (axis_ >= 0) point.side = n.exact()[axis_] < 0 ? -1 : 1;
  if (filtered_) point.w = pair_.filter().Difference(point.pair);
  return point;
}

// Explores along n; a result when that settles it.
std::optional<PortalSearch::Result> PortalSearch::Explore(Direction& n, Point* farthest) {
  if (poll_.Step()) return Result{};
  *farthest = Farthest(n);
  if (SignAlong(n, *farthest) < 0) return Result{Verdict::kSeparated, n.exact(), {}};
  return std::nullopt;
}

PortalSearch::Result PortalSearch::Run() {
  if (filtered_) ray_ = -pair_.filter().InnerDifference();
  const bool is_certain = filtered_ && LargestOf(ray_) > position_error_;
  if (!is_certain && IsZero(ExactRay())) return {Verdict::kOverlapping, {}, {}};
  if (std::optional<Result> early = FindPortal()) return *std::move(early);
  return RefinePortal();
}

// Fills portal_ with a triangle that the ray's line crosses: a vertex p, one to the left and one to
// the right of the plane through p and the ray, moved until their segment passes on the far side of
// the ray from p.
std::optional<PortalSearch::Result> PortalSearch::FindPortal() {
  auto& [p, left, right] = portal_;
  Direction along(*this, Kind::kRay);
  if (auto result = Explore(along, &p)) return result;
  if (IsOnRay(p)) {
    // p is on the ray's line; a vertex farthest along a direction across the ray is not.
    Direction across(*this, AnyPerpendicular(ExactRay()));
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

PortalSearch::Result PortalSearch::RefinePortal() {
  auto& [p, q, r] = portal_;
  for (;;) {
    // n.p, as the triple product is the same for edges and for points.
    const int side = Sign3(p, q, r);
    if (side > 0) return {Verdict::kOverlapping, {}, {}};
    Point w;
    Direction n(*this, Kind::kNormal, &p, &q, &r);
    if (poll_.Step()) return {};
    w = Farthest(n);
    const bool is_corner = std::any_of(portal_.begin(), portal_.end(), [&](const Point& corner) {
      return corner.pair == w.pair && corner.side == w.side;
    });
    if ((is_corner ? side : SignAlong(n, w)) < 0) return {Verdict::kSeparated, n.exact(), {}};
    if (is_corner || SignOfAdvance(n, p, q, r, w) <= 0) {
      return {Verdict::kTouching, n.exact(), {{p.pair, q.pair, r.pair}}};
    }
    Replace(w);
  }
}

// Puts w in place of the corner that leaves the ray crossing the portal. Corners turn left in
// order; exactly one consecutive pair has w to the right of the first and to the left of the
// second, unless w is in line with a corner.
void PortalSearch::Replace(const Point& w) {
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

}  // namespace hulld
