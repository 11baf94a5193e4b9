#include "tests/bench/queries/query_sets.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/hull/growth/hull_builder.h"
#include "core/query/collision.h"
#include "tests/bench/bench_random.h"
#include "tests/source_tree.h"

namespace hulld::bench {
namespace {

constexpr size_t kHullsPerSet = 32;
// Number of hulls in a set of hulls with more than kLargeHull vertices: fewer, because placed
// copies fill the memory.
constexpr size_t kLargeHullsPerSet = 8;
constexpr size_t kLargeHull = 5000;

Hull BuildHull(const std::vector<Vector>& points) {
  HullBuilder builder;
  if (!builder.Add(points).ok()) std::abort();
  return builder.Snapshot();
}

std::vector<Vector> OnEllipsoid(Random& random, size_t count) {
  const Vector axes(random.Between(0.5, 1.5), random.Between(0.5, 1.5), random.Between(0.5, 1.5));
  std::vector<Vector> points;
  for (size_t i = 0; i < count; ++i) points.push_back(random.UnitVector().cwiseProduct(axes));
  return points;
}

// Returns the corners of the triangles of a binary STL file.
std::vector<Vector> ReadStl(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  std::vector<Vector> points;
  constexpr size_t kHeader = 84;
  constexpr size_t kTriangle = 50;
  for (size_t at = kHeader; at + kTriangle <= bytes.size(); at += kTriangle) {
    float corners[9];
    std::memcpy(corners, bytes.data() + at + 12, sizeof corners);
    for (int i = 0; i < 9; i += 3) points.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
  }
  return points;
}

// Rounds to the nearest multiples of 2^-40: sums and differences of a few of them are doubles.
Vector Snapped(const Vector& p) { return (p * 0x1p40).array().round() * 0x1p-40; }

Hull Snapped(const Hull& hull) {
  std::vector<Vector> points;
  for (const Vector& p : hull.vertices()) points.push_back(Snapped(p));
  return BuildHull(points);
}

// Returns the identity or a rotation of a cube about a diagonal: they permute the axes, and their
// matrices are exact.
std::array<double, 4> AxisPermutation(Random& random) {
  if (random.Below(4) == 0) return {1, 0, 0, 0};
  const auto sign = [&] { return random.Below(2) == 0 ? 1.0 : -1.0; };
  return {1, sign(), sign(), sign()};
}

void AddHulls(const std::string& name, Random& random, QuerySet& set) {
  if (name == "ur5") {
    for (const char* link :
         {"base", "shoulder", "upperarm", "forearm", "wrist1", "wrist2", "wrist3"}) {
      const std::vector<Vector> points = ReadStl(RealData() / "ur5" / (std::string(link) + ".stl"));
      if (!points.empty()) set.hulls.push_back(BuildHull(points));
    }
    return;
  }
  const size_t count = std::stoul(name.substr(name.find(':') + 1));
  const size_t hulls = count > kLargeHull ? kLargeHullsPerSet : kHullsPerSet;
  for (size_t i = 0; i < hulls; ++i) set.hulls.push_back(BuildHull(OnEllipsoid(random, count)));
}

// Returns a multiple of 1/64: few bits, like the lengths of a model.
double Length(Random& random, double low, double high) {
  return std::round(random.Between(low, high) * 64) / 64;
}

// Returns a block with random length, width, and height, its base on z = 0.
std::vector<Vector> Block(Random& random) {
  const Vector half(Length(random, 0.25, 1), Length(random, 0.25, 1), 0);
  const double height = Length(random, 0.5, 2);
  std::vector<Vector> points;
  for (int i = 0; i < 8; ++i) {
    points.emplace_back((i & 1) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                        (i & 4) != 0 ? height : 0);
  }
  return points;
}

// Returns a part: a flat base on z = 0 with a quarter of the points, and a rounded body above it.
std::vector<Vector> Part(Random& random, size_t count) {
  constexpr double kGrid = 4096;
  std::vector<Vector> points;
  const size_t base = count / 4;
  for (size_t i = 0; i < base; ++i) {
    const double angle = 2 * M_PI * static_cast<double>(i) / static_cast<double>(base);
    points.emplace_back(std::round(std::cos(angle) * kGrid) / kGrid,
                        std::round(std::sin(angle) * kGrid) / kGrid, 0);
  }
  while (points.size() < count) {
    const Vector u = 1.5 * random.UnitVector() + Vector(0, 0, 1.625);
    points.push_back((u * kGrid).array().round() / kGrid);
  }
  return points;
}

// Places base on base, shifted along it; B is A's kind of hull upside down. No rotation.
void AddMatings(const std::string& name, Random& random, size_t count, QuerySet& set) {
  const auto base_up = [](std::vector<Vector> points) {
    for (Vector& p : points) p.z() = -p.z();
    return points;
  };
  const size_t vertices = std::stoul(name.substr(name.find(':') + 1));
  const auto shape = [&] { return vertices == 8 ? Block(random) : Part(random, vertices); };
  for (size_t i = 0; i < kHullsPerSet; ++i) {
    set.hulls.push_back(BuildHull(i % 2 == 0 ? base_up(shape()) : shape()));
  }
  for (const Hull& hull : set.hulls) set.query_hulls.emplace_back(hull);
  for (size_t i = 0; i < count; ++i) {
    const size_t hull_a = 2 * random.Below(kHullsPerSet / 2);
    const size_t hull_b = 2 * random.Below(kHullsPerSet / 2) + 1;
    Pose X_WA;
    X_WA.t = Vector(Length(random, -2, 2), Length(random, -2, 2), Length(random, -2, 2));
    Pose X_WB;
    X_WB.t = X_WA.t + Vector(Length(random, -0.5, 0.5), Length(random, -0.5, 0.5), 0);
    set.queries.push_back({hull_a, hull_b, X_WA, X_WB});
    set.a.push_back(*PlacedHull::Make(set.query_hulls[hull_a], X_WA));
    set.b.push_back(*PlacedHull::Make(set.query_hulls[hull_b], X_WB));
  }
}

// Returns the pose of B at which its farthest vertex against `direction` coincides with A's
// farthest along it: they touch there, separated by the plane perpendicular to `direction`.
// Requires: snapped hulls and exact rotations.
Pose TouchVertices(const QueryHull& a, const Pose& X_WA, const QueryHull& b, Pose X_WB,
                   const Vector& direction) {
  const Eigen::Matrix3d R_WA = PlacedHull::Make(a, X_WA)->R_WH();
  const Eigen::Matrix3d R_WB = PlacedHull::Make(b, X_WB)->R_WH();
  const auto farthest = [](const QueryHull& hull, const Vector& n) {
    return hull.hull().vertices()[hull.Farthest(n).vertex];
  };
  const Vector p = R_WA * farthest(a, R_WA.transpose() * direction) + X_WA.t;
  X_WB.t = p - R_WB * farthest(b, R_WB.transpose() * -direction);
  return X_WB;
}

// Moves B from A's center along `direction` until the pair is in the regime.
Pose Place(const QueryHull& a, const Pose& X_WA, const QueryHull& b, Pose X_WB,
           const Vector& direction, Regime regime, Random& random) {
  const PlacedHull placed_a = *PlacedHull::Make(a, X_WA);
  const Vector center_b = PlacedHull::Make(b, X_WB)->rotated_center();
  const Vector start = placed_a.rotated_center() + X_WA.t - center_b;
  const double reach = a.radius() + b.radius();
  const auto at = [&](double distance) {
    Pose X = X_WB;
    X.t = start + distance * direction;
    return X;
  };
  if (regime == Regime::kFar) return at(reach * random.Between(1.5, 3));
  double colliding = 0;
  double separated = 1.01 * reach;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (colliding + separated);
    const bool apart = CheckCollision(placed_a, *PlacedHull::Make(b, at(middle)))->relation ==
                       Relation::kSeparated;
    (apart ? separated : colliding) = middle;
  }
  switch (regime) {
    case Regime::kClose:
      return at(separated + reach * random.Between(0.01, 0.05));
    case Regime::kGap:
      return at(separated + 1e-6 * reach);
    case Regime::kGraze:
      return at(separated - 1e-6 * reach);
    case Regime::kDeep:
      return at(0.5 * separated);
    default:
      return at(separated);
  }
}

}  // namespace

const char* Name(Regime regime) {
  switch (regime) {
    case Regime::kFar:
      return "far";
    case Regime::kClose:
      return "close";
    case Regime::kGap:
      return "gap";
    case Regime::kTouch:
      return "touch";
    case Regime::kContact:
      return "contact";
    case Regime::kGraze:
      return "graze";
    case Regime::kDeep:
      break;
  }
  return "deep";
}

QuerySet MakeQuerySet(const std::string& name, Regime regime, size_t count) {
  QuerySet set;
  set.name = name + "/" + Name(regime);
  Random random(20261121 + static_cast<uint64_t>(regime));
  if (name.starts_with("mating:")) {
    if (regime == Regime::kContact) AddMatings(name, random, count, set);
    return set;
  }
  AddHulls(name, random, set);
  if (set.hulls.empty()) return set;
  const bool exact = regime == Regime::kContact;
  if (exact) {
    for (Hull& hull : set.hulls) hull = Snapped(hull);
  }
  for (const Hull& hull : set.hulls) set.query_hulls.emplace_back(hull);
  for (size_t i = 0; i < count; ++i) {
    const size_t hull_a = random.Below(set.hulls.size());
    const size_t hull_b = random.Below(set.hulls.size());
    const QueryHull& a = set.query_hulls[hull_a];
    const QueryHull& b = set.query_hulls[hull_b];
    Pose X_WA;
    X_WA.q = exact ? AxisPermutation(random) : random.Rotation();
    X_WA.t = random.UnitVector() * random.Between(0, 2);
    Pose X_WB;
    X_WB.q = exact ? AxisPermutation(random) : random.Rotation();
    if (exact) {
      X_WA.t = Snapped(X_WA.t);
      X_WB = TouchVertices(a, X_WA, b, X_WB, random.UnitVector());
    } else {
      X_WB = Place(a, X_WA, b, X_WB, random.UnitVector(), regime, random);
    }
    set.queries.push_back({hull_a, hull_b, X_WA, X_WB});
    set.a.push_back(*PlacedHull::Make(a, X_WA));
    set.b.push_back(*PlacedHull::Make(b, X_WB));
  }
  return set;
}

}  // namespace hulld::bench
