#include "tests/bench/queries/accuracy_suite.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/hull/growth/hull_builder.h"
#include "core/query/collision.h"
#include "tests/bench/bench_random.h"

namespace hulld::bench {
namespace {

using Points = std::vector<Vector>;

Hull BuildHull(const Points& points) {
  HullBuilder builder;
  if (!builder.Add(points).ok()) std::abort();
  return builder.Snapshot();
}

Points Ellipsoid(Random& random, size_t count) {
  const Vector axes(random.Between(0.5, 1.5), random.Between(0.5, 1.5), random.Between(0.5, 1.5));
  Points points;
  for (size_t i = 0; i < count; ++i) points.push_back(random.UnitVector().cwiseProduct(axes));
  return points;
}

Points Box(const Vector& half) {
  Points points;
  for (int corner = 0; corner < 8; ++corner) {
    points.emplace_back((corner & 1) != 0 ? half.x() : -half.x(),
                        (corner & 2) != 0 ? half.y() : -half.y(),
                        (corner & 4) != 0 ? half.z() : -half.z());
  }
  return points;
}

Points Polygon(Random& random, size_t count) {
  Points points;
  const double start = random.Between(0, 1);
  for (size_t i = 0; i < count; ++i) {
    const double angle =
        start + 6.283185307179586 * static_cast<double>(i) / static_cast<double>(count);
    points.emplace_back(std::cos(angle), std::sin(angle), 0);
  }
  return points;
}

Points Prism(Random& random, size_t sides) {
  Points points = Polygon(random, sides);
  for (size_t i = 0; i < sides; ++i) points.emplace_back(points[i].x(), points[i].y(), 1);
  return points;
}

Points Scaled(Points points, const Vector& factors) {
  for (Vector& p : points) p = p.cwiseProduct(factors);
  return points;
}

Points Rotated(Points points, const std::array<double, 4>& q) {
  const Eigen::Matrix3d R =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  for (Vector& p : points) p = R * p;
  return points;
}

struct Pair {
  Points a;
  Points b;
  // From A toward B.
  Vector direction;
};

enum class Family { kFew, kMany, kBoxes, kPrisms, kNeedles, kPlates, kPolygons, kNearlyParallel };
constexpr std::pair<Family, const char*> kFamilies[] = {
    {Family::kFew, "8 points"},      {Family::kMany, "32 points"},
    {Family::kBoxes, "boxes"},       {Family::kPrisms, "prisms"},
    {Family::kNeedles, "needles"},   {Family::kPlates, "plates"},
    {Family::kPolygons, "polygons"}, {Family::kNearlyParallel, "nearly parallel"}};

// Two long crossed boxes, edge against edge, at an angle of 1e-12 to 1e-3.
Pair NearlyParallel(Random& random) {
  const double angle = std::pow(10.0, -random.Between(3, 12));
  const Vector half(1, 0.1, 0.1);
  constexpr double kEighthTurn = 0.39269908169872414;
  const std::array<double, 4> on_edge = {std::cos(kEighthTurn), std::sin(kEighthTurn), 0, 0};
  const std::array<double, 4> about_z = {std::cos(angle / 2), 0, 0, std::sin(angle / 2)};
  const Points a = Rotated(Box(half), on_edge);
  const Points b = Rotated(a, about_z);
  const std::array<double, 4> common = random.Rotation();
  const Points up = Rotated({Vector::UnitZ()}, common);
  return {Rotated(a, common), Rotated(b, common), up[0]};
}

Pair MakePair(Family family, Random& random) {
  const auto shape = [&]() -> Points {
    switch (family) {
      case Family::kFew:
        return Ellipsoid(random, 8);
      case Family::kMany:
        return Ellipsoid(random, 32);
      case Family::kBoxes:
        return Box({random.Between(0.2, 1), random.Between(0.2, 1), random.Between(0.2, 1)});
      case Family::kPrisms:
        return Prism(random, 3 + random.Below(8));
      case Family::kNeedles:
        return Scaled(Ellipsoid(random, 10), {1, 1e-3, 1e-3});
      case Family::kPlates:
        return Scaled(Box({1, 1, 1}), {1, random.Between(0.2, 1), 1e-4});
      default:
        return Polygon(random, 3 + random.Below(8));
    }
  };
  if (family == Family::kNearlyParallel) return NearlyParallel(random);
  Pair pair = {Rotated(shape(), random.Rotation()), Rotated(shape(), random.Rotation()),
               random.UnitVector()};
  // Polygons meet polygons or solids; solids meet solids of the same kind.
  if (family == Family::kPolygons && random.Below(2) == 0) {
    pair.b = Rotated(Ellipsoid(random, 8), random.Rotation());
  }
  return pair;
}

struct Setting {
  const char* name;
  double size;
  double offset;
};
constexpr Setting kSettings[] = {
    {"size 1", 1, 0}, {"size 1e-6", 1e-6, 0}, {"size 1e6", 1e6, 0}, {"offset 1e6", 1, 1e6}};

class Maker {
 public:
  explicit Maker(size_t stride) : stride_(stride) {}

  // Adds two hulls `gap` apart along the pair's direction from contact, relative to their size.
  void AddNearContact(const char* family, const Pair& pair, double gap, const Setting& setting,
                      Random& random) {
    const Vector offset = setting.offset * random.UnitVector();
    if (!Wanted()) return;
    const Vector factors = Vector::Constant(setting.size);
    suite_.hulls.push_back(BuildHull(Scaled(pair.a, factors)));
    suite_.hulls.push_back(BuildHull(Scaled(pair.b, factors)));
    const QueryHull a(suite_.hulls[suite_.hulls.size() - 2]);
    const QueryHull b(suite_.hulls.back());
    Pose X_WA;
    X_WA.t = offset;
    const PlacedHull placed_a = *PlacedHull::Make(a, X_WA);
    const double reach = a.radius() + b.radius();
    const Vector start = X_WA.t + a.hull().center() - b.hull().center();
    const auto at = [&](double distance) {
      Pose X_WB;
      X_WB.t = start + distance * pair.direction;
      return X_WB;
    };
    double colliding = 0;
    double separated = 1.01 * reach;
    constexpr int kHalvings = 60;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (colliding + separated);
      const bool apart = CheckCollision(placed_a, *PlacedHull::Make(b, at(middle)))->relation ==
                         Relation::kSeparated;
      (apart ? separated : colliding) = middle;
    }
    Add(X_WA, at(separated + gap * reach), std::string(family) + ", " + setting.name);
  }

  // Adds boxes with corners on a lattice, moved so that they touch: facet to facet, edge to edge,
  // corner to corner (features 1, 2 or 3 of the axes in contact), or a corner of a rotated box to a
  // facet.
  void AddContact(Random& random) {
    const auto whole = [&](size_t most) { return static_cast<double>(1 + random.Below(most)); };
    const Vector half_a(whole(64), whole(64), whole(64));
    const Vector half_b(whole(64), whole(64), whole(64));
    const size_t features = random.Below(4);
    Points a = Box(half_a);
    Points b = features == 0 ? Octahedron(half_b) : Box(half_b);
    Vector move = half_a + half_b;
    // Along the other axes, a random shift keeps the contact.
    for (size_t axis = std::max<size_t>(features, 1); axis < 3; ++axis) {
      const double reach = features == 0 ? half_a[axis] : move[axis];
      move[axis] = std::floor(random.Between(-reach, reach));
    }
    const double size = std::exp2(std::floor(random.Between(-20, 20)));
    // Equal rotations: permuted axes keep every coordinate a double.
    const size_t turn = random.Below(3);
    const auto turned = [&](const Vector& p) {
      return Vector(size * Vector(p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3]));
    };
    if (!Wanted()) return;
    for (Vector& p : a) p = turned(p);
    for (Vector& p : b) p = turned(p);
    suite_.hulls.push_back(BuildHull(a));
    suite_.hulls.push_back(BuildHull(b));
    Pose X_WA;
    X_WA.t = size * Vector(whole(1000), whole(1000), whole(1000));
    Pose X_WB;
    X_WB.t = X_WA.t + turned(move);
    Add(X_WA, X_WB, "contact");
  }

  AccuracySuite Take() { return std::move(suite_); }

 private:
  static Points Octahedron(const Vector& half) {
    Points points;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Vector p = Vector::Zero();
        p[axis] = sign * half[axis];
        points.push_back(p);
      }
    }
    return points;
  }

  bool Wanted() { return next_++ % stride_ == 0; }

  void Add(const Pose& X_WA, const Pose& X_WB, std::string kind) {
    const size_t count = suite_.hulls.size();
    suite_.queries.push_back({count - 2, count - 1, X_WA, X_WB});
    suite_.kinds.push_back(std::move(kind));
  }

  size_t stride_;
  size_t next_ = 0;
  AccuracySuite suite_;
};

}  // namespace

AccuracySuite MakeAccuracySuite(size_t stride) {
  Random random(20261121);
  Maker maker(stride);
  constexpr int kRepetitions = 5;
  constexpr int kContacts = 320;
  for (const auto& [family, name] : kFamilies) {
    for (const Setting& setting : kSettings) {
      for (int exponent = -15; exponent <= -3; ++exponent) {
        for (const double sign : {-1.0, 1.0}) {
          for (int i = 0; i < kRepetitions; ++i) {
            const Pair pair = MakePair(family, random);
            maker.AddNearContact(name, pair, sign * std::pow(10.0, exponent), setting, random);
          }
        }
      }
      for (int i = 0; i < kRepetitions; ++i) {
        maker.AddNearContact(name, MakePair(family, random), 0, setting, random);
      }
    }
  }
  for (int i = 0; i < kContacts; ++i) maker.AddContact(random);
  return maker.Take();
}

}  // namespace hulld::bench
