#ifndef HULLD_TESTS_CORE_QUERY_BODY_RATIONAL_WORLD_H_
#define HULLD_TESTS_CORE_QUERY_BODY_RATIONAL_WORLD_H_

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <span>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/relation.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/oracle/brute_force_relation.h"

// Poses and their products in rational numbers, directly from the definition.
namespace hulld {

using Rational = boost::multiprecision::number<boost::multiprecision::cpp_rational::backend_type,
                                               boost::multiprecision::et_off>;
using RationalPoint = std::array<Rational, 3>;
// Outermost pose first: p_W = poses[0] (poses[1] p).
using PoseChain = std::vector<Pose>;

// Returns R(q) / |q|^2. Number: double or Rational.
template <typename Number>
std::array<RationalPoint, 3> RationalRotation(const std::array<Number, 4>& q) {
  const Rational w(q[0]), x(q[1]), y(q[2]), z(q[3]);
  const Rational n = w * w + x * x + y * y + z * z;
  return {RationalPoint{(w * w + x * x - y * y - z * z) / n, 2 * (x * y - w * z) / n,
                        2 * (x * z + w * y) / n},
          RationalPoint{2 * (x * y + w * z) / n, (w * w - x * x + y * y - z * z) / n,
                        2 * (y * z - w * x) / n},
          RationalPoint{2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n,
                        (w * w - x * x - y * y + z * z) / n}};
}

inline RationalPoint ToRational(const Vector& v) {
  return {Rational(v.x()), Rational(v.y()), Rational(v.z())};
}

inline RationalPoint Placed(const PoseChain& poses, RationalPoint p) {
  for (size_t k = poses.size(); k-- > 0;) {
    const auto rows = RationalRotation(poses[k].q);
    RationalPoint turned;
    for (int i = 0; i < 3; ++i) {
      turned[i] =
          rows[i][0] * p[0] + rows[i][1] * p[1] + rows[i][2] * p[2] + Rational(poses[k].t[i]);
    }
    p = turned;
  }
  return p;
}

// Returns two hulls at products of poses in the world, at a common scale that makes all coordinates
// integers.
inline oracle::WorldPoints RationalWorld(const Hull& a, const PoseChain& poses_a, const Hull& b,
                                         const PoseChain& poses_b) {
  using boost::multiprecision::denominator;
  using boost::multiprecision::numerator;
  std::vector<RationalPoint> all;
  for (const Vector& p : a.vertices()) all.push_back(Placed(poses_a, ToRational(p)));
  for (const Vector& p : b.vertices()) all.push_back(Placed(poses_b, ToRational(p)));
  oracle::Integer scale = 1;
  for (const RationalPoint& p : all) {
    for (const Rational& x : p) scale = lcm(scale, oracle::Integer(denominator(x)));
  }
  oracle::WorldPoints world;
  for (size_t i = 0; i < all.size(); ++i) {
    oracle::IntegerVector scaled;
    for (int k = 0; k < 3; ++k) {
      scaled[k] =
          oracle::Integer(numerator(all[i][k])) * (scale / oracle::Integer(denominator(all[i][k])));
    }
    (i < a.vertices().size() ? world.a : world.b).push_back(scaled);
  }
  return world;
}

// Returns the relation of two hulls at products of poses, by the integer oracle.
inline Relation RationalRelation(const Hull& a, const PoseChain& poses_a, const Hull& b,
                                 const PoseChain& poses_b) {
  const oracle::WorldPoints world = RationalWorld(a, poses_a, b, poses_b);
  if (world.a.empty() || world.b.empty()) return Relation::kSeparated;
  return FromOracle(world.a.size() * world.b.size() <= 36 ? oracle::RelationByPolarCone(world)
                                                          : oracle::RelationByLinearProgram(world));
}

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_QUERY_BODY_RATIONAL_WORLD_H_
