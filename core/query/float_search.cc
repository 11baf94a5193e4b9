#include "core/query/float_search.h"

#include <algorithm>
#include <cmath>

#include "core/numeric/error_bounds.h"

namespace hulld {
namespace {

// More directions than this are spent only near contact, where exact signs are needed anyway.
// Observed: random pairs of up to 10000 vertices, 1 % apart, need fewer than 30.
constexpr uint64_t kMaxDirections = 64;

class FloatSpace {
 public:
  using Direction = Vector;
  struct Point {
    Vector w;
    // The support value along the direction it was found for.
    double value = 0;
  };
  static constexpr bool kExact = false;

  explicit FloatSpace(const FloatPair& pair) : pair_(pair) {}

  uint64_t directions_tried() const { return directions_tried_; }
  bool MayContinue() const { return directions_tried_ < kMaxDirections; }
  Vector Center() const { return pair_.CenterDifference(); }

  // To a largest component in [1/2, 1), by a power of two.
  Vector Scaled(const Vector& n) const {
    int exponent = 0;
    std::frexp(n.cwiseAbs().maxCoeff(), &exponent);
    return n.unaryExpr([exponent](double component) { return std::ldexp(component, -exponent); });
  }

  Point Farthest(const Vector& n) {
    ++directions_tried_;
    const uint32_t a = pair_.FarthestA(n);
    const uint32_t b = pair_.FarthestB(n);
    return {pair_.PositionA(a) - pair_.PositionB(b), pair_.Value(n, a, b)};
  }

  bool IsBelowOrigin(const Vector& n, const Point& farthest) const {
    return farthest.value < -pair_.SupportError(n);
  }

  bool HoldsOrigin(const Vector& center, const Point& p, const Point& q, const Point& r) const {
    double largest = center.cwiseAbs().maxCoeff();
    for (const Point* point : {&p, &q, &r}) {
      largest = std::max(largest, point->w.cwiseAbs().maxCoeff());
    }
    const double position_error = kMinkowskiErrorFactor * pair_.size();
    const double bound = kTetrahedronErrorFactor * largest * largest * position_error;
    const auto volume = [](const Vector& u, const Vector& v, const Vector& w) {
      return u.dot(v.cross(w));
    };
    // The origin's barycentric coordinates in the tetrahedron, up to a common factor.
    return volume(p.w, q.w, r.w) > bound && volume(center, r.w, q.w) > bound &&
           volume(center, p.w, r.w) > bound && volume(center, q.w, p.w) > bound;
  }

 private:
  const FloatPair& pair_;
  uint64_t directions_tried_ = 0;
};

}  // namespace

FloatSearchResult SearchInFloatingPoint(const FloatPair& pair) {
  FloatSpace space(pair);
  FloatSearchResult result;
  result.portal = PortalSearch<FloatSpace>(space).Run();
  result.directions_tried = space.directions_tried();
  return result;
}

}  // namespace hulld
