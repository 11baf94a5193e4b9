#include "tests/oracle/brute_force_relation.h"

#include "tests/oracle/origin_position.h"

namespace hulld::oracle {
namespace {

// |q|^2 R and |q|^2, for an integer multiple of q (which denotes the same rotation).
struct IntegerRotation {
  std::array<IntegerVector, 3> rows;
  Integer norm_squared;
};

IntegerRotation RotationOf(const std::array<double, 4>& q) {
  const std::vector<Integer> integers = ToIntegers(q);
  const Integer& w = integers[0];
  const Integer& x = integers[1];
  const Integer& y = integers[2];
  const Integer& z = integers[3];
  const Integer ww = w * w, xx = x * x, yy = y * y, zz = z * z;
  return {{IntegerVector{ww + xx - yy - zz, 2 * (x * y - w * z), 2 * (x * z + w * y)},
           IntegerVector{2 * (x * y + w * z), ww - xx + yy - zz, 2 * (y * z - w * x)},
           IntegerVector{2 * (x * z - w * y), 2 * (y * z + w * x), ww - xx - yy + zz}},
          ww + xx + yy + zz};
}

// Returns other_norm * (R p + norm * t): the world coordinates times both norms.
std::vector<IntegerVector> Place(std::span<const IntegerVector> points,
                                 const IntegerRotation& rotation, const IntegerVector& t,
                                 const Integer& other_norm) {
  std::vector<IntegerVector> result;
  for (const IntegerVector& p : points) {
    IntegerVector& placed = result.emplace_back();
    for (int k = 0; k < 3; ++k) {
      placed[k] = other_norm * (Dot(rotation.rows[k], p) + rotation.norm_squared * t[k]);
    }
  }
  return result;
}

Relation RelationOf(OriginPosition position) {
  switch (position) {
    case OriginPosition::kOutside:
      return Relation::kSeparated;
    case OriginPosition::kBoundary:
      return Relation::kTouching;
    case OriginPosition::kInside:
      break;
  }
  return Relation::kOverlapping;
}

}  // namespace

WorldPoints PlaceInWorld(std::span<const Point> a, const Placement& X_WA, std::span<const Point> b,
                         const Placement& X_WB) {
  // A single call converts all lengths, so that they share the same power of two.
  std::vector<Point> lengths(a.begin(), a.end());
  lengths.insert(lengths.end(), b.begin(), b.end());
  lengths.push_back(X_WA.t);
  lengths.push_back(X_WB.t);
  const std::vector<IntegerVector> integers = ToIntegerVectors(lengths);
  const std::span<const IntegerVector> all(integers);
  const IntegerRotation rotation_a = RotationOf(X_WA.q);
  const IntegerRotation rotation_b = RotationOf(X_WB.q);
  return {
      Place(all.subspan(0, a.size()), rotation_a, integers[integers.size() - 2],
            rotation_b.norm_squared),
      Place(all.subspan(a.size(), b.size()), rotation_b, integers.back(), rotation_a.norm_squared)};
}

Relation RelationByPolarCone(const WorldPoints& points) {
  std::vector<IntegerVector> differences;
  for (const IntegerVector& p : points.a) {
    for (const IntegerVector& q : points.b) differences.push_back(Subtract(p, q));
  }
  return RelationOf(LocateByPolarCone(differences));
}

Relation RelationByLinearProgram(const WorldPoints& points) {
  return RelationOf(LocateInDifference(points.a, points.b));
}

Relation BruteForceRelation(std::span<const Point> a, const Placement& X_WA,
                            std::span<const Point> b, const Placement& X_WB) {
  const WorldPoints points = PlaceInWorld(a, X_WA, b, X_WB);
  return a.size() * b.size() <= 36 ? RelationByPolarCone(points) : RelationByLinearProgram(points);
}

}  // namespace hulld::oracle
