#include "tests/oracle/brute_force_separation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace hulld::oracle {
namespace {

// All distinct differences of the points, and the ruler.
struct Differences {
  std::vector<IntegerVector> points;
  double unit;
  Integer ruler_squared;
};

Differences DifferencesOf(std::span<const Point> a, const Placement& X_WA, std::span<const Point> b,
                          const Placement& X_WB) {
  // The ruler is two more points of A, with a length of the same magnitude as the other points.
  double size = 0;
  for (const auto& points : {a, b}) {
    for (const Point& p : points) {
      for (const double x : p) size = std::max(size, std::abs(x));
    }
  }
  const double unit = size > 0 ? std::ldexp(1.0, std::ilogb(size)) : 1.0;
  std::vector<Point> with_ruler(a.begin(), a.end());
  with_ruler.push_back({0, 0, 0});
  with_ruler.push_back({unit, 0, 0});
  WorldPoints world = PlaceInWorld(with_ruler, X_WA, b, X_WB);
  const IntegerVector ruler = Subtract(world.a.back(), world.a[a.size()]);
  world.a.resize(a.size());
  Differences result{{}, unit, Dot(ruler, ruler)};
  for (const IntegerVector& p : world.a) {
    for (const IntegerVector& q : world.b) result.points.push_back(Subtract(p, q));
  }
  std::sort(result.points.begin(), result.points.end());
  result.points.erase(std::unique(result.points.begin(), result.points.end()), result.points.end());
  return result;
}

// Minimum of the squared lengths passed to it.
class Least {
 public:
  void Consider(const Integer& numerator, const Integer& denominator) {
    if (found_ && numerator * denominator_ >= numerator_ * denominator) return;
    found_ = true;
    numerator_ = numerator;
    denominator_ = denominator;
  }
  SquaredLength In(const Differences& differences) const {
    return {numerator_, denominator_, differences.unit, differences.ruler_squared};
  }

 private:
  bool found_ = false;
  Integer numerator_ = 0;
  Integer denominator_ = 1;
};

// Adds the distance of the origin from the line if the foot is strictly inside the segment.
void ConsiderEdge(const IntegerVector& p, const IntegerVector& q, Least& least) {
  const IntegerVector e = Subtract(q, p);
  if (Dot(p, e) >= 0 || Dot(q, e) <= 0) return;
  const IntegerVector moment = Cross(p, q);
  least.Consider(Dot(moment, moment), Dot(e, e));
}

// Adds the distance of the origin from the plane if the foot is strictly inside the triangle.
void ConsiderTriangle(const IntegerVector& p, const IntegerVector& q, const IntegerVector& r,
                      Least& least) {
  const IntegerVector n = Cross(Subtract(q, p), Subtract(r, p));
  if (Dot(n, Cross(p, q)) <= 0 || Dot(n, Cross(q, r)) <= 0 || Dot(n, Cross(r, p)) <= 0) return;
  const Integer height = Dot(n, p);
  least.Consider(height * height, Dot(n, n));
}

}  // namespace

SquaredLength BruteForceDistance(std::span<const Point> a, const Placement& X_WA,
                                 std::span<const Point> b, const Placement& X_WB) {
  const Differences differences = DifferencesOf(a, X_WA, b, X_WB);
  const std::vector<IntegerVector>& w = differences.points;
  Least least;
  for (size_t i = 0; i < w.size(); ++i) {
    least.Consider(Dot(w[i], w[i]), 1);
    for (size_t j = i + 1; j < w.size(); ++j) {
      ConsiderEdge(w[i], w[j], least);
      for (size_t k = j + 1; k < w.size(); ++k) ConsiderTriangle(w[i], w[j], w[k], least);
    }
  }
  return least.In(differences);
}

SquaredLength BruteForceDepth(std::span<const Point> a, const Placement& X_WA,
                              std::span<const Point> b, const Placement& X_WB) {
  const Differences differences = DifferencesOf(a, X_WA, b, X_WB);
  const std::vector<IntegerVector>& w = differences.points;
  Least least;
  for (size_t i = 0; i < w.size(); ++i) {
    for (size_t j = i + 1; j < w.size(); ++j) {
      for (size_t k = j + 1; k < w.size(); ++k) {
        const IntegerVector n = Cross(Subtract(w[j], w[i]), Subtract(w[k], w[i]));
        if (IsZero(n)) continue;
        const Integer height = Dot(n, w[i]);
        const bool supports =
            std::all_of(w.begin(), w.end(), [&](const auto& p) { return Dot(n, p) <= height; }) ||
            std::all_of(w.begin(), w.end(), [&](const auto& p) { return Dot(n, p) >= height; });
        if (supports) least.Consider(height * height, Dot(n, n));
      }
    }
  }
  return least.In(differences);
}

bool IsWithin(const SquaredLength& length, double value, double bound) {
  const double numbers[] = {std::abs(value), bound, length.unit};
  const std::vector<Integer> integers = ToIntegers(numbers);
  const Integer low = integers[0] > integers[1] ? Integer(integers[0] - integers[1]) : Integer(0);
  const Integer high = integers[0] + integers[1];
  const Integer left = length.numerator * integers[2] * integers[2];
  const Integer right = length.denominator * length.ruler_squared;
  return low * low * right <= left && left <= high * high * right;
}

int Compare(const SquaredLength& length, double threshold) {
  const double numbers[] = {threshold, length.unit};
  const std::vector<Integer> integers = ToIntegers(numbers);
  return Sign(length.numerator * integers[1] * integers[1] -
              integers[0] * integers[0] * length.denominator * length.ruler_squared);
}

int CompareSum(int sign, const SquaredLength& length, std::span<const double> terms) {
  std::vector<double> numbers(terms.begin(), terms.end());
  numbers.push_back(length.unit);
  const std::vector<Integer> integers = ToIntegers(numbers);
  Integer sum = 0;
  for (size_t i = 0; i < terms.size(); ++i) sum += integers[i];
  const int sign_of_length = length.numerator == 0 ? 0 : sign;
  if (sign_of_length != Sign(sum)) return sign_of_length < Sign(sum) ? -1 : 1;
  const Integer unit = integers.back();
  return sign_of_length * Sign(length.numerator * unit * unit -
                               sum * sum * length.denominator * length.ruler_squared);
}

}  // namespace hulld::oracle
