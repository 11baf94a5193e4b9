#include "tests/oracle/origin_position.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "tests/oracle/linear_program.h"

namespace hulld::oracle {
namespace {

__extension__ typedef __int128 Int128;

template <typename Int>
using Vec = std::array<Int, 3>;

template <typename Int>
Vec<Int> CrossProduct(const Vec<Int>& a, const Vec<Int>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <typename Int>
Int DotProduct(const Vec<Int>& a, const Vec<Int>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <typename Int>
bool IsNull(const Vec<Int>& a) {
  return a[0] == 0 && a[1] == 0 && a[2] == 0;
}

// Polar cone within the span of the points: the sum of its extreme rays.
template <typename Int>
class PolarCone {
 public:
  explicit PolarCone(const std::vector<Vec<Int>>& points) : points_(points) {}

  // Adds `ray` or its opposite if it is extreme. Requires: `ray` is perpendicular to points that
  // determine its line.
  void Try(const Vec<Int>& ray) {
    if (IsNull(ray)) return;
    bool negative = false;
    bool positive = false;
    for (const Vec<Int>& p : points_) {
      const Int d = DotProduct(ray, p);
      negative |= d < 0;
      positive |= d > 0;
      if (negative && positive) return;
    }
    for (int k = 0; k < 3; ++k) {
      if (negative) {
        sum_[k] -= ray[k];
      } else {
        sum_[k] += ray[k];
      }
    }
    trivial_ = false;
  }

  bool trivial() const { return trivial_; }
  bool HasStrictElement() const {
    return std::all_of(points_.begin(), points_.end(),
                       [&](const Vec<Int>& p) { return DotProduct(sum_, p) > 0; });
  }

 private:
  const std::vector<Vec<Int>>& points_;
  Vec<Int> sum_ = {0, 0, 0};
  bool trivial_ = true;
};

template <typename Int>
OriginPosition LocateSpatial(const std::vector<Vec<Int>>& points) {
  PolarCone<Int> cone(points);
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t j = i + 1; j < points.size(); ++j) cone.Try(CrossProduct(points[i], points[j]));
  }
  if (cone.trivial()) return OriginPosition::kInside;
  return cone.HasStrictElement() ? OriginPosition::kOutside : OriginPosition::kBoundary;
}

// Locates the origin if all points are in one plane through the origin with this normal: applies
// the two-dimensional method, projected along a coordinate axis that the plane does not contain.
template <typename Int>
OriginPosition LocatePlanar(const std::vector<Vec<Int>>& points, const Vec<Int>& normal) {
  const int drop = normal[0] != 0 ? 0 : normal[1] != 0 ? 1 : 2;
  const int x = (drop + 1) % 3;
  const int y = (drop + 2) % 3;
  std::vector<Vec<Int>> projected;
  for (const Vec<Int>& p : points) projected.push_back({p[x], p[y], Int(0)});
  PolarCone<Int> cone(projected);
  for (const Vec<Int>& p : projected) cone.Try({-p[1], p[0], Int(0)});
  return !cone.trivial() && cone.HasStrictElement() ? OriginPosition::kOutside
                                                    : OriginPosition::kBoundary;
}

template <typename Int>
OriginPosition Locate(const std::vector<Vec<Int>>& points) {
  if (points.empty()) return OriginPosition::kOutside;
  const auto first = std::find_if_not(points.begin(), points.end(), IsNull<Int>);
  if (first == points.end()) return OriginPosition::kBoundary;
  Vec<Int> normal = {0, 0, 0};
  bool strict = true;
  for (const Vec<Int>& p : points) {
    if (IsNull(normal)) normal = CrossProduct(*first, p);
    strict &= DotProduct(*first, p) > 0;
  }
  if (IsNull(normal)) return strict ? OriginPosition::kOutside : OriginPosition::kBoundary;
  const bool planar = std::all_of(points.begin(), points.end(),
                                  [&](const Vec<Int>& p) { return DotProduct(normal, p) == 0; });
  return planar ? LocatePlanar(points, normal) : LocateSpatial(points);
}

template <typename Int>
OriginPosition LocateAs(std::span<const IntegerVector> points) {
  std::vector<Vec<Int>> converted;
  for (const IntegerVector& p : points) {
    converted.push_back({static_cast<Int>(p[0]), static_cast<Int>(p[1]), static_cast<Int>(p[2])});
  }
  std::sort(converted.begin(), converted.end());
  converted.erase(std::unique(converted.begin(), converted.end()), converted.end());
  return Locate(converted);
}

size_t BitLength(const Integer& value) {
  return value == 0 ? 0 : boost::multiprecision::msb(boost::multiprecision::abs(value)) + 1;
}

}  // namespace

OriginPosition LocateByPolarCone(std::span<const IntegerVector> points) {
  size_t bits = 0;
  for (const IntegerVector& p : points) {
    for (const Integer& coordinate : p) bits = std::max(bits, BitLength(coordinate));
  }
  // Coordinates have b bits, cross products 2b + 1, their sum over n^2 pairs 2 log2(n) more, its
  // dot products b + 2 more. Selects the fastest type that holds these.
  size_t pair_bits = 0;
  while ((size_t{1} << pair_bits) < points.size() * points.size()) ++pair_bits;
  const size_t needed = 3 * bits + 3 + pair_bits;
  if (needed <= 62) return LocateAs<int64_t>(points);
  if (needed <= 126) return LocateAs<Int128>(points);
  return LocateAs<Integer>(points);
}

OriginPosition LocateInDifference(std::span<const IntegerVector> a,
                                  std::span<const IntegerVector> b) {
  if (a.empty() || b.empty()) return OriginPosition::kOutside;
  // Rows: the three coordinates of sum(weights * A) - sum(weights * B), then the sums of weights.
  std::vector<std::vector<Integer>> columns;
  for (const IntegerVector& p : a) columns.push_back({p[0], p[1], p[2], 1, 0});
  for (const IntegerVector& p : b) columns.push_back({-p[0], -p[1], -p[2], 0, 1});
  if (!HasNonnegativeSolution(columns, {0, 0, 0, 1, 1})) return OriginPosition::kOutside;

  // The cone of the differences: equal sums of weights, of any size. It is R^3, and the origin is
  // inside, iff it contains four vectors that positively span R^3.
  for (std::vector<Integer>& column : columns) {
    column[3] -= column[4];
    column.pop_back();
  }
  const int targets[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, -1, -1}};
  for (const auto& target : targets) {
    if (!HasNonnegativeSolution(columns, {target[0], target[1], target[2], 0})) {
      return OriginPosition::kBoundary;
    }
  }
  return OriginPosition::kInside;
}

}  // namespace hulld::oracle
