#include "core/query/placed/center_bounds.h"

#include <span>
#include <vector>

#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
// Cells along a side of a face, a power of two so that corners are exact. A choice: with it half of
// the pairs of round hulls of 512 vertices a few percent apart are settled, and nearly all that are
// deep in each other (observed: relation/ of tests/bench/queries/query_benchmark).
uint32_t SideFor(size_t vertices) { return vertices < 24 ? 2 : 8; }
// With more cells than this along a side the gauge, which takes a look at each facet, is made at
// every other corner.
constexpr uint32_t kMostGaugedCells = 4;

// Facets whose planes a ray leaves this little behind the nearest are looked at, too.
constexpr double kTie = 1 - 0x1p-30;
// The point of a ray that is shown to be inside, relative to the ray's part in the hull.
constexpr double kShrink = 1 - 0x1p-22;

float RoundedUp(double value) {
  const auto rounded = static_cast<float>(value);
  return static_cast<double>(rounded) < value ? std::nextafter(rounded, kInfinity) : rounded;
}

// Whether p is in the tetrahedron of a point o strictly inside a hull and a triangle of a facet.
// Exact.
bool IsInCone(const Vector& o, const Vector& a, const Vector& b, const Vector& c, const Vector& p) {
  return Orient3d(o, a, b, p) >= 0 && Orient3d(o, b, c, p) >= 0 && Orient3d(o, c, a, p) >= 0 &&
         Orient3d(a, b, c, p) <= 0;
}

bool IsInside(const Hull& hull, const Vector& o) {
  const auto v = hull.vertices();
  for (size_t f = 0; f < hull.facet_count(); ++f) {
    const auto facet = hull.facet(f);
    if (Orient3d(v[facet[0]], v[facet[1]], v[facet[2]], o) >= 0) return false;
  }
  return true;
}

// Facets as seen from a point inside: n . (x - o) < 1 there.
class Polar {
 public:
  Polar(const Hull& hull, const Vector& o) : hull_(hull), o_(o) {
    const auto v = hull.vertices();
    normals_.reserve(hull.facet_count());
    for (size_t f = 0; f < hull.facet_count(); ++f) {
      const auto facet = hull.facet(f);
      Vector n = Vector::Zero();
      for (size_t i = 2; i < facet.size(); ++i) {
        n += (v[facet[i - 1]] - v[facet[0]]).cross(v[facet[i]] - v[facet[0]]);
      }
      normals_.emplace_back(n / n.dot(v[facet[0]] - o));
    }
    values_.resize(normals_.size());
  }

  // Some t such that o + t d, as rounded, is in the hull, and almost as large as it may be; 0 when
  // none was found.
  double Reach(const Vector& d) {
    double largest = 0;
    for (size_t f = 0; f < normals_.size(); ++f) {
      values_[f] = normals_[f].dot(d);
      largest = std::max(largest, values_[f]);
    }
    const double t = kShrink / largest;
    const Vector p = o_ + t * d;
    if (!p.allFinite()) return 0;
    for (size_t f = 0; f < normals_.size(); ++f) {
      if (values_[f] >= largest * kTie && IsInConeOf(f, p)) return t;
    }
    return 0;
  }

 private:
  bool IsInConeOf(size_t f, const Vector& p) const {
    const auto v = hull_.vertices();
    const auto facet = hull_.facet(f);
    for (size_t i = 2; i < facet.size(); ++i) {
      if (IsInCone(o_, v[facet[0]], v[facet[i - 1]], v[facet[i]], p)) return true;
    }
    return false;
  }

  const Hull& hull_;
  const Vector o_;
  std::vector<Vector> normals_;
  std::vector<double> values_;
};

}  // namespace

CenterBounds::CenterBounds(const Hull& hull, const SupportMap& support) {
  if (hull.dimension() < 3) return;
  double radius = 0;
  for (const Vector& v : hull.vertices()) {
    radius = std::max(radius, (v - hull.center()).cwiseAbs().maxCoeff());
  }
  // Beyond what pairs may have, or so small against the coordinates that rounding counts.
  if (!IsFilterSize(radius)) return;
  if (radius < kCenterLeastRadius * hull.max_abs_coordinate()) return;
  side_ = SideFor(hull.vertices().size());
  half_ = 0.5 * side_;
  unit_ = std::ldexp(1.0, std::ilogb(radius));
  per_unit_ = 1 / unit_;
  corners_.resize(size_t{6} * (side_ + 1) * (side_ + 1), {kInfinity, kUnknown});
  AddSupports(hull, support, radius);
  AddGauges(hull);
}

Vector CenterBounds::DirectionOf(uint32_t corner) const {
  const uint32_t row = side_ + 1;
  const double s = (corner / row % row) / half_ - 1;
  const double t = (corner % row) / half_ - 1;
  return CubeDirection(corner / (row * row), s, t);
}

void CenterBounds::AddSupports(const Hull& hull, const SupportMap& support, double radius) {
  const double blur = kSupportBlurFactor * hull.max_abs_coordinate();
  const double margin = kCenterMargin * radius;
  for (uint32_t i = 0; i < corners_.size(); ++i) {
    const Vector n = DirectionOf(i);
    const double reach = support.CertainFarthest(n, blur).value - n.dot(hull.center());
    corners_[i].support = RoundedUp((reach + margin) * per_unit_);
  }
}

void CenterBounds::AddGauges(const Hull& hull) {
  if (!IsInside(hull, hull.center())) return;
  Polar polar(hull, hull.center());
  const uint32_t row = side_ + 1;
  const uint32_t step = side_ > kMostGaugedCells ? 2 : 1;
  double least = std::numeric_limits<double>::infinity();
  for (uint32_t i = 0; i < corners_.size(); ++i) {
    if (i / row % row % step != 0 || i % row % step != 0) continue;
    const double t = polar.Reach(DirectionOf(i));
    least = std::min(least, t);
    if (!(t > 0)) break;
    corners_[i].gauge = RoundedUp((1 + kCenterMargin) * unit_ / t);
  }
  // All or none: only a centre that is surrounded is strictly inside, up to rounding.
  if (!(least >= kCenterLeastRadius * hull.max_abs_coordinate())) {
    for (Corner& corner : corners_) corner.gauge = kUnknown;
    return;
  }
  largest_gauge_ = (1 + kCenterMargin) / least;
  if (step == 1) return;
  for (uint32_t i = 0; i < corners_.size(); ++i) {
    const uint32_t down = i / row % row % 2 * row;
    const uint32_t right = i % row % 2;
    if (down == 0 && right == 0) continue;
    // The mean of the two or four around it, which are as far on either side.
    const auto gauge = [&](uint32_t corner) { return double{corners_[corner].gauge}; };
    const double sum = gauge(i - down - right) + gauge(i - down + right) + gauge(i + down - right) +
                       gauge(i + down + right);
    corners_[i].gauge = RoundedUp(0.25 * sum);
  }
}

}  // namespace hulld
