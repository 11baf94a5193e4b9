#include "tests/oracle/certificate_check.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/oracle/origin_position.h"

namespace hulld::oracle {
namespace {

// Returns min n.B - max n.A.
Integer Gap(const IntegerVector& n, const WorldPoints& points) {
  Integer reach = Dot(n, points.a.front());
  for (const IntegerVector& p : points.a) reach = std::max(reach, Dot(n, p));
  Integer start = Dot(n, points.b.front());
  for (const IntegerVector& p : points.b) start = std::min(start, Dot(n, p));
  return start - reach;
}

std::string DirectionFault(const Certificate& certificate, int min_gap, const WorldPoints& points) {
  if (certificate.direction.size() != 3) return "no direction";
  const IntegerVector n = {certificate.direction[0], certificate.direction[1],
                           certificate.direction[2]};
  if (IsZero(n)) return "the direction is zero";
  return Sign(Gap(n, points)) >= min_gap ? "" : "the direction does not separate";
}

}  // namespace

std::string FaultOf(const Certificate& certificate, Relation relation, const WorldPoints& points) {
  std::vector<IntegerVector> differences;
  for (const auto& [a, b] : certificate.pairs) {
    if (a >= points.a.size() || b >= points.b.size()) return "a pair is out of range";
    differences.push_back(Subtract(points.a[a], points.b[b]));
  }
  if (relation == Relation::kSeparated) {
    if (!differences.empty()) return "pairs, although separated";
    return DirectionFault(certificate, 1, points);
  }
  if (relation == Relation::kTouching) {
    if (differences.size() > 4) return "more than four pairs";
    if (LocateByPolarCone(differences) == OriginPosition::kOutside) return "0 is not between pairs";
    return DirectionFault(certificate, 0, points);
  }
  if (!certificate.direction.empty()) return "a direction, although overlapping";
  if (differences.size() > 6) return "more than six pairs";
  if (LocateByPolarCone(differences) != OriginPosition::kInside) return "0 is not inside the pairs";
  return "";
}

namespace {

// Squared distance of the origin from the hull of points, as a fraction.
struct Fraction {
  Integer numerator = 0;
  Integer denominator = 1;
};

void KeepLess(const Integer& numerator, const Integer& denominator,
              std::optional<Fraction>& least) {
  if (least && numerator * least->denominator >= least->numerator * denominator) return;
  least = Fraction{numerator, denominator};
}

Fraction SquaredDistance(const std::vector<IntegerVector>& w) {
  if (LocateByPolarCone(w) != OriginPosition::kOutside) return {};
  std::optional<Fraction> least;
  for (size_t i = 0; i < w.size(); ++i) {
    KeepLess(Dot(w[i], w[i]), 1, least);
    for (size_t j = i + 1; j < w.size(); ++j) {
      const IntegerVector e = Subtract(w[j], w[i]);
      const IntegerVector moment = Cross(w[i], w[j]);
      if (Dot(w[i], e) < 0 && Dot(w[j], e) > 0) KeepLess(Dot(moment, moment), Dot(e, e), least);
      for (size_t k = j + 1; k < w.size(); ++k) {
        const IntegerVector n = Cross(e, Subtract(w[k], w[i]));
        const bool is_above = Dot(n, Cross(w[i], w[j])) > 0 && Dot(n, Cross(w[j], w[k])) > 0 &&
                              Dot(n, Cross(w[k], w[i])) > 0;
        if (is_above) KeepLess(Dot(n, w[i]) * Dot(n, w[i]), Dot(n, n), least);
      }
    }
  }
  return *least;
}

}  // namespace

std::string FaultOfRounded(const Certificate& certificate, Relation relation,
                           std::span<const Point> a, const Placement& X_WA,
                           std::span<const Point> b, const Placement& X_WB,
                           std::span<const double> radii) {
  // Two more points of A reveal the scale of the integers: one unit of length along an axis, in the
  // unit of the radii below.
  std::vector<double> lengths(radii.begin(), radii.end());
  for (const auto& points : {a, b}) {
    for (const Point& p : points) lengths.insert(lengths.end(), p.begin(), p.end());
  }
  const double largest = *std::max_element(
      lengths.begin(), lengths.end(), [](double x, double y) { return std::abs(x) < std::abs(y); });
  const double unit = std::ldexp(1.0, std::ilogb(largest));
  std::vector<Point> with_ruler(a.begin(), a.end());
  with_ruler.push_back({0, 0, 0});
  with_ruler.push_back({unit, 0, 0});
  WorldPoints points = PlaceInWorld(with_ruler, X_WA, b, X_WB);
  const IntegerVector ruler = Subtract(points.a.back(), points.a[a.size()]);
  points.a.resize(a.size());
  lengths.resize(radii.size());
  lengths.push_back(unit);
  const std::vector<Integer> integers = ToIntegers(lengths);
  Integer sum = 0;
  for (size_t i = 0; i < radii.size(); ++i) sum += integers[i];
  // r^2 at the scale of the points is r_squared / unit_squared.
  const Integer r_squared = sum * sum * Dot(ruler, ruler);
  const Integer unit_squared = integers.back() * integers.back();

  std::vector<IntegerVector> differences;
  for (const auto& [i, j] : certificate.pairs) {
    if (i >= points.a.size() || j >= points.b.size()) return "a pair is out of range";
    differences.push_back(Subtract(points.a[i], points.b[j]));
  }
  if (relation == Relation::kOverlapping) {
    if (!certificate.direction.empty()) return "a direction, although overlapping";
  } else {
    if (certificate.direction.size() != 3) return "no direction";
    const IntegerVector n = {certificate.direction[0], certificate.direction[1],
                             certificate.direction[2]};
    if (IsZero(n)) return "the direction is zero";
    const Integer gap = Gap(n, points);
    const int more = Sign(gap * gap * unit_squared - r_squared * Dot(n, n));
    if (gap < 0 || more < (relation == Relation::kSeparated ? 1 : 0)) {
      return "the direction does not separate";
    }
  }
  if (relation == Relation::kSeparated) {
    return differences.empty() ? "" : "pairs, although separated";
  }
  if (differences.empty()) return "no pairs";
  if (differences.size() > (relation == Relation::kTouching ? 4 : 6)) return "too many pairs";
  const Fraction distance = SquaredDistance(differences);
  const int farther = Sign(distance.numerator * unit_squared - r_squared * distance.denominator);
  if (farther > (relation == Relation::kTouching ? 0 : -1)) return "the pairs are too far from 0";
  return "";
}

}  // namespace hulld::oracle
