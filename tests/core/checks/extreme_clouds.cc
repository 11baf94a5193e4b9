#include "tests/core/checks/extreme_clouds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <ostream>

#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace {

using Points = std::vector<Vector>;

constexpr uint64_t kSeed = 601;
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

Points Ball(int n, double radius) {
  Random random(kSeed);
  return RandomInBall(random, n, radius);
}

Points Sphere(int n, double radius) {
  Random random(kSeed);
  return RandomOnSphere(random, n, radius);
}

Points Turned(Points points) {
  const double c = std::cos(1.0);
  const double s = std::sin(1.0);
  for (Vector& p : points) {
    p = Vector(c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z());
    p = Vector(p.x(), c * p.y() - s * p.z(), s * p.y() + c * p.z());
  }
  return points;
}

Points Stretched(Points points, const Vector& factors) {
  for (Vector& p : points) p = p.cwiseProduct(factors);
  return points;
}

double Ulp(double x) { return std::nextafter(std::abs(x), kLargest) - std::abs(x); }

// Moves each coordinate by -1, 0 or 1 unit in its last place.
Points Nudged(Points points) {
  Random random(kSeed);
  for (Vector& p : points) {
    for (double& x : p) x += random.Between(-1, 1) * Ulp(x);
  }
  return points;
}

// Multiples of the least subnormal.
Points SubnormalLattice(int n) {
  Points points = Ball(n, 40);
  for (Vector& p : points) p = Vector(p.array().round()) * kLeast;
  return points;
}

// Up to the largest double on every axis.
Points LargestCube(int n) {
  Random random(kSeed);
  Points points = Concatenated(Scaled(RandomInCube(random, n - 8, 1), kLargest),
                               Scaled(Shifted(LatticeCube(2, 2), Vector::Constant(-1)), kLargest));
  Shuffle(random, points);
  return points;
}

Points PlaneWithRounding(int n) {
  Random random(kSeed);
  Points points;
  for (int i = 0; i < n; ++i) {
    const double x = random.Real(-1, 1);
    const double y = random.Real(-1, 1);
    points.emplace_back(x, y, 0.3 * x - 0.7 * y + 0.1);
  }
  return points;
}

// An exact tilted integer plane, and a point one unit in the last place above its middle.
Points PlaneAndOneUlp(int n) {
  const int side = static_cast<int>(std::sqrt(n));
  Points points;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) points.emplace_back(i, j, i + 2 * j + 1);
  }
  const size_t middle = points.size() / 2 + static_cast<size_t>(side) / 2;
  points[middle].z() = std::nextafter(points[middle].z(), kLargest);
  return points;
}

Points BoxFacesWithinAnUlp(int n) {
  Random random(kSeed);
  Points points;
  for (int i = 0; i < n; ++i) {
    Vector p(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
    p[i % 3] = (i % 2 ? 1 : -1) * (1 + random.Between(-1, 1) * 0x1p-52);
    points.push_back(p);
  }
  return points;
}

// n integer points on a sphere around the origin: exactly cospherical. The radius grows until
// enough points exist; its square stays 1 modulo 4, because 4^a (8b + 7) is not a sum of three
// squares.
Points Cospherical(int n) {
  for (int64_t radius_squared = 4 * n + 1;; radius_squared = 2 * radius_squared - 1) {
    const auto r = static_cast<int64_t>(std::sqrt(static_cast<double>(radius_squared)));
    Points points;
    for (int64_t x = -r; x <= r; ++x) {
      for (int64_t y = -r; y <= r; ++y) {
        const int64_t rest = radius_squared - x * x - y * y;
        if (rest < 0) continue;
        const auto z = static_cast<int64_t>(std::llround(std::sqrt(static_cast<double>(rest))));
        if (z * z != rest) continue;
        points.emplace_back(x, y, z);
        if (z != 0) points.emplace_back(x, y, -z);
      }
    }
    if (points.size() < static_cast<size_t>(n)) continue;
    Random random(kSeed);
    Shuffle(random, points);
    points.resize(static_cast<size_t>(n));
    return points;
  }
}

// Two facets of n / 2 vertices each on integer circles, exactly cocircular and cospherical, joined
// by rectangles.
Points Drum(int n) {
  constexpr int64_t kRadius = 5 * 13 * 17 * 29;
  Points circle;
  for (int64_t x = -kRadius; x <= kRadius; ++x) {
    const int64_t rest = kRadius * kRadius - x * x;
    const auto y = static_cast<int64_t>(std::llround(std::sqrt(static_cast<double>(rest))));
    if (y * y != rest) continue;
    circle.emplace_back(x, y, 0);
    if (y != 0) circle.emplace_back(x, -y, 0);
  }
  Random random(kSeed);
  Shuffle(random, circle);
  circle.resize(std::min(circle.size(), static_cast<size_t>(n / 2)));
  return Concatenated(circle, Shifted(circle, Vector(0, 0, 1000)));
}

// Each coordinate with its own magnitude, 10^-exponent to 10^exponent.
Points MixedMagnitudes(int n, double exponent) {
  Random random(kSeed);
  Points points;
  for (int i = 0; i < n; ++i) {
    Vector p;
    for (double& x : p) {
      x = random.Real(-1, 1) * std::pow(10.0, random.Real(-exponent, exponent));
    }
    points.push_back(p);
  }
  return points;
}

// Concentric spheres of 64 points, each ten times as large as the previous, from 1e-150.
Points NestedScales(int n) {
  Points points;
  for (int i = 0; i < n; i += 64) {
    points = Concatenated(points, Sphere(64, std::pow(10.0, -150 + 300.0 * i / n)));
  }
  return points;
}

// Clusters a billionth wide at the corners of a cube.
Points TinyClusters(int n) {
  Random random(kSeed);
  Points points;
  for (int i = 0; i < n; ++i) {
    const Vector corner(random.Below(2), random.Below(2), random.Below(2));
    points.push_back(corner + RandomInBall(random, 1, 1e-9).front());
  }
  return points;
}

Points SortedAlongX(Points points) {
  std::sort(points.begin(), points.end(),
            [](const Vector& p, const Vector& q) { return p.x() < q.x(); });
  return points;
}

// Alternates between the two ends of the x axis.
Points FromBothEnds(const Points& sorted) {
  Points points;
  for (size_t i = 0, j = sorted.size(); i < j;) {
    points.push_back(sorted[i++]);
    if (i < j) points.push_back(sorted[--j]);
  }
  return points;
}

Points GrowingShells(int n) {
  Points points;
  for (int i = 0; i < n; i += 32) points = Concatenated(points, Sphere(32, 1 + i));
  return points;
}

// First all points of a tilted plane, then a ball on each side of it.
Points PlaneFirst(int n) {
  Random random(kSeed);
  Points points;
  for (int i = 0; i < n / 2; ++i) {
    points.push_back(random.Between(-20, 20) * Vector(3, 1, -2) +
                     random.Between(-20, 20) * Vector(-1, 4, 5));
  }
  return Concatenated(points, Ball(n - n / 2, 40));
}

// Each apex sees all sides of the previous cone: n^2 / 4 triangles in all.
Points CircleThenRisingApexes(int n) {
  Points points;
  for (int i = 0; i < n / 2; ++i) {
    const double angle = 4 * std::numbers::pi * i / n;
    points.emplace_back(std::cos(angle), std::sin(angle), 0);
  }
  for (int i = 1; i <= n - n / 2; ++i) points.emplace_back(0, 0, i);
  return points;
}

// Repeats distinct points, n in all.
Points Repeated(const Points& distinct, int n) {
  Points points;
  for (int i = 0; i < n; ++i) points.push_back(distinct[static_cast<size_t>(i) % distinct.size()]);
  return points;
}

std::vector<Extreme> MakeExtremes() {
  using enum Arithmetic;
  std::vector<Extreme> all;
  const auto add = [&](const char* name, Arithmetic needs, std::function<Points(int)> make) {
    all.push_back({name, std::move(make), needs});
  };
  add("scale_5e_324", kAny, SubnormalLattice);
  add("scale_1e_310", kAny, [](int n) { return Ball(n, 1e-310); });
  add("scale_1e_300", kAny, [](int n) { return Ball(n, 1e-300); });
  add("scale_1e_200", kAny, [](int n) { return Ball(n, 1e-200); });
  add("scale_1e_100", kAny, [](int n) { return Ball(n, 1e-100); });
  add("scale_1e_30", kAny, [](int n) { return Ball(n, 1e-30); });
  add("scale_1e30", kAny, [](int n) { return Ball(n, 1e30); });
  add("scale_1e100", kAny, [](int n) { return Ball(n, 1e100); });
  add("scale_1e200", kAny, [](int n) { return Ball(n, 1e200); });
  add("scale_1e300", kAny, [](int n) { return Ball(n, 1e300); });
  add("scale_1e300_sphere", kAny, [](int n) { return Sphere(n, 1e300); });
  add("scale_1e_300_sphere", kAny, [](int n) { return Sphere(n, 1e-300); });
  add("scale_largest", kAny, LargestCube);
  add("offset_1e15", kAny, [](int n) { return Shifted(Ball(n, 100), Vector::Constant(1e15)); });
  add("offset_1e15_one_axis", kAny, [](int n) { return Shifted(Ball(n, 1), Vector(1e15, 0, 0)); });
  add("offset_1e15_few_ulps", kExact,
      [](int n) { return Shifted(Sphere(n, 2), Vector(1e15, -1e15, 1e15)); });
  add("ulp_tilted_plane", kExact, PlaneWithRounding);
  add("ulp_tilted_plane_nudged", kExact, [](int n) { return Nudged(PlaneWithRounding(n)); });
  add("ulp_one_point_off_plane", kExact, PlaneAndOneUlp);
  add("ulp_box_faces", kAny, BoxFacesWithinAnUlp);
  add("ulp_rotated_lattice", kExact,
      [](int n) { return Turned(LatticeCube(static_cast<int>(std::lround(std::cbrt(n))), 0.1)); });
  add("cospherical", kExact, Cospherical);
  add("cospherical_1e15", kExact,
      [](int n) { return Shifted(Cospherical(n), Vector::Constant(1e15)); });
  add("cospherical_1e300", kExact, [](int n) { return Scaled(Cospherical(n), 0x1p980); });
  add("cocircular_drum", kExact, Drum);
  add("sliver_pancake", kAny, [](int n) { return Turned(Stretched(Ball(n, 1), {1, 1, 1e-12})); });
  add("sliver_needle", kExact, [](int n) {
    return Turned(Stretched(Ball(n, 1), {1, 1e-12, 1e-12}));
  });
  add("sliver_needle_on_axis", kAny, [](int n) {
    return Stretched(Sphere(n, 1), {1, 1e-12, 1e-12});
  });
  add("sliver_blade", kAny, [](int n) { return Stretched(Sphere(n, 1), {1, 1e-12, 1e-24}); });
  add("mixed_1e60", kAny, [](int n) { return MixedMagnitudes(n, 60); });
  add("mixed_1e300", kAny, [](int n) { return MixedMagnitudes(n, 300); });
  add("mixed_nested_scales", kAny, NestedScales);
  add("mixed_tilted_plane", kIntegers, [](int n) {
    return Stretched(PlaneWithRounding(n), {0x1p-900, 1, 0x1p900});
  });
  add("mixed_tiny_clusters", kAny, TinyClusters);
  add("order_sorted", kAny, [](int n) { return SortedAlongX(Sphere(n, 1)); });
  add("order_both_ends", kAny, [](int n) { return FromBothEnds(SortedAlongX(Sphere(n, 1))); });
  add("order_spiral", kAny, [](int n) { return FibonacciSphere(n); });
  add("order_growing_shells", kAny, GrowingShells);
  add("order_plane_first", kExact, PlaneFirst);
  add("order_rising_apexes", kAny, CircleThenRisingApexes);
  all.back().facets_one_by_one = [](int n) { return int64_t{n / 2} * (n - n / 2); };
  add("duplicates_of_one", kAny, [](int n) { return Repeated({{0.1, 0.2, 0.3}}, n); });
  add("duplicates_of_cube", kAny, [](int n) { return Repeated(LatticeCube(2, 0.1), n); });
  add("duplicates_of_sphere", kAny, [](int n) { return Repeated(Sphere(500, 1), n); });
  return all;
}

}  // namespace

std::span<const Extreme> Extremes() {
  static const std::vector<Extreme> kAll = MakeExtremes();
  return kAll;
}

void PrintTo(const Extreme& extreme, std::ostream* out) { *out << extreme.name; }

std::vector<Vector> GenericCloud(int n, int vertices) {
  Random random(kSeed);
  Points points =
      Concatenated(RandomOnSphere(random, vertices, 1), RandomInBall(random, n - vertices, 0.5));
  Shuffle(random, points);
  return points;
}

}  // namespace hulld
