#include "tests/core/checks/axis_check.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/core/checks/oracle_bridge.h"
#include "tests/oracle/brute_force_relation.h"

namespace hulld {
namespace {

using oracle::Integer;
using oracle::IntegerVector;

// Both hulls in the world, at a common positive scale.
struct Scene {
  const Hull& a;
  const Hull& b;
  oracle::WorldPoints world;
};

// Maximum of A along n and minimum of B.
struct Support {
  Integer gap;  // min n.B - max n.A
  std::vector<uint32_t> argmax_a;
  std::vector<uint32_t> argmin_b;
};

std::vector<uint32_t> ArgMax(const std::vector<IntegerVector>& points, const IntegerVector& n,
                             Integer* maximum) {
  std::vector<uint32_t> best;
  for (size_t i = 0; i < points.size(); ++i) {
    const Integer value = oracle::Dot(n, points[i]);
    if (best.empty() || value > *maximum) {
      best.clear();
      *maximum = value;
    }
    if (value == *maximum) best.push_back(static_cast<uint32_t>(i));
  }
  return best;
}

Support SupportAlong(const Scene& scene, const IntegerVector& n) {
  Integer max_a, max_minus_b;
  Support result;
  result.argmax_a = ArgMax(scene.world.a, n, &max_a);
  result.argmin_b = ArgMax(scene.world.b, oracle::Negate(n), &max_minus_b);
  result.gap = -max_minus_b - max_a;
  return result;
}

size_t LargestBit(const IntegerVector& v) {
  size_t bit = 0;
  for (const Integer& x : v) {
    if (x != 0) bit = std::max(bit, size_t{boost::multiprecision::msb(abs(x))});
  }
  return bit;
}

// Returns v / |v|, within a few units in the last place. Requires: v != 0.
Vector ToUnit(const IntegerVector& v) {
  const size_t bit = LargestBit(v);
  Vector result;
  for (int k = 0; k < 3; ++k) {
    Integer magnitude = abs(v[k]);
    if (bit > 62) {
      magnitude >>= bit - 62;
    } else {
      magnitude <<= 62 - bit;
    }
    result[k] = std::copysign(static_cast<double>(static_cast<uint64_t>(magnitude)), v[k].sign());
  }
  return result / result.norm();
}

// The direction is n / |n| correctly rounded up to this, in each coordinate. **Observed**: errors
// of one normalization in doubles stay below 4e-16.
constexpr double kDirectionTolerance = 1e-15;

bool Agrees(const IntegerVector& n, const Vector& direction) {
  return !oracle::IsZero(n) && (ToUnit(n) - direction).cwiseAbs().maxCoeff() <= kDirectionTolerance;
}

// Returns the facet normals of a hull and their negatives: an axis is a line.
std::vector<IntegerVector> FacetNormals(const Hull& hull, const std::vector<IntegerVector>& world) {
  std::vector<IntegerVector> result;
  for (size_t i = 0; i < hull.facet_count(); ++i) {
    const std::span<const uint32_t> polygon = hull.facet(i);
    const IntegerVector n = oracle::Cross(oracle::Subtract(world[polygon[1]], world[polygon[0]]),
                                          oracle::Subtract(world[polygon[2]], world[polygon[0]]));
    result.push_back(n);
    result.push_back(oracle::Negate(n));
  }
  return result;
}

// Returns the edges perpendicular to the direction within its rounding. No other edge can be a
// factor of a matching cross product.
std::vector<IntegerVector> EdgesAcross(const Hull& hull, const std::vector<IntegerVector>& world,
                                       const Vector& direction) {
  std::vector<IntegerVector> result;
  for (const Edge& edge : hull.edges()) {
    const IntegerVector vector = oracle::Subtract(world[edge.head], world[edge.tail]);
    if (std::abs(ToUnit(vector).dot(direction)) <= 10 * kDirectionTolerance) {
      result.push_back(vector);
    }
  }
  return result;
}

std::vector<IntegerVector> EdgeCrossProducts(const Scene& scene, const Vector& direction) {
  std::vector<IntegerVector> result;
  for (const IntegerVector& edge_a : EdgesAcross(scene.a, scene.world.a, direction)) {
    for (const IntegerVector& edge_b : EdgesAcross(scene.b, scene.world.b, direction)) {
      const IntegerVector n = oracle::Cross(edge_a, edge_b);
      result.push_back(n);
      result.push_back(oracle::Negate(n));
    }
  }
  return result;
}

// Returns the fault of an exact direction n; empty if it separates at exactly the given features.
std::string ExactFault(const Scene& scene, const IntegerVector& n, Relation relation,
                       const SeparatingAxis& axis) {
  const Support support = SupportAlong(scene, n);
  if (relation == Relation::kSeparated && support.gap <= 0) return "does not separate strictly";
  if (relation == Relation::kTouching && support.gap != 0) return "has a gap that is not zero";
  if (support.argmax_a != axis.feature_a.vertices) return "is extreme at other vertices of A";
  if (support.argmin_b != axis.feature_b.vertices) return "is extreme at other vertices of B";
  return "";
}

// Like ExactFault, but for a direction known up to rounding: checks the gap, and that the features
// are extreme, within that rounding times the size of the scene.
std::string RoundedFault(const Scene& scene, const SeparatingAxis& axis) {
  const oracle::Point rounded = {axis.direction.x(), axis.direction.y(), axis.direction.z()};
  const std::vector<Integer> integers = oracle::ToIntegers(rounded);
  const IntegerVector n = {integers[0], integers[1], integers[2]};
  Integer size = 0;
  const auto measure = [&](const std::vector<IntegerVector>& points) {
    for (const IntegerVector& p : points) {
      for (const Integer& x : p) size = std::max(size, Integer(abs(x)));
    }
  };
  measure(scene.world.a);
  measure(scene.world.b);
  // 2^-45 times |n| times the size of the scene.
  const Integer slack = (size << (LargestBit(n) + 3)) >> 48;
  const Support support = SupportAlong(scene, n);
  if (support.gap < -slack) return "does not separate";
  const Integer max_a = oracle::Dot(n, scene.world.a[support.argmax_a[0]]);
  for (uint32_t v : axis.feature_a.vertices) {
    if (max_a - oracle::Dot(n, scene.world.a[v]) > slack)
      return "is extreme at other vertices of A";
  }
  const Integer min_b = oracle::Dot(n, scene.world.b[support.argmin_b[0]]);
  for (uint32_t v : axis.feature_b.vertices) {
    if (oracle::Dot(n, scene.world.b[v]) - min_b > slack)
      return "is extreme at other vertices of B";
  }
  return "";
}

// Returns the facet with exactly these vertices, if any.
std::optional<uint32_t> FacetOf(const Hull& hull, const std::vector<uint32_t>& vertices) {
  for (size_t i = 0; i < hull.facet_count(); ++i) {
    std::vector<uint32_t> polygon(hull.facet(i).begin(), hull.facet(i).end());
    std::sort(polygon.begin(), polygon.end());
    if (polygon == vertices) return static_cast<uint32_t>(i);
  }
  return std::nullopt;
}

std::string FeatureFault(const Feature& feature, const Hull& hull) {
  if (feature.vertices.empty()) return "has no vertices";
  if (std::adjacent_find(feature.vertices.begin(), feature.vertices.end(),
                         std::greater_equal<>()) != feature.vertices.end()) {
    return "has vertices that are not in ascending order";
  }
  if (feature.vertices.back() >= hull.vertices().size()) return "has a vertex out of range";
  if (feature.facet != FacetOf(hull, feature.vertices)) {
    return "names a facet that does not have exactly its vertices, or omits one that does";
  }
  return "";
}

// Returns the exact directions that the axis's kind allows; empty if the kind does not determine
// them.
std::vector<IntegerVector> Candidates(const Scene& scene, const SeparatingAxis& axis) {
  switch (axis.kind) {
    case AxisKind::kFacetA:
      return FacetNormals(scene.a, scene.world.a);
    case AxisKind::kFacetB:
      return FacetNormals(scene.b, scene.world.b);
    case AxisKind::kEdgeEdge:
      return EdgeCrossProducts(scene, axis.direction);
    case AxisKind::kFlat:
    case AxisKind::kGeneral:
      break;
  }
  return {};
}

std::string AxisFault(const Scene& scene, Relation relation, const SeparatingAxis& axis) {
  if (!(std::abs(axis.direction.norm() - 1) <= kDirectionTolerance)) return "is not of unit length";
  if (std::string fault = FeatureFault(axis.feature_a, scene.a); !fault.empty()) {
    return "feature_a " + fault;
  }
  if (std::string fault = FeatureFault(axis.feature_b, scene.b); !fault.empty()) {
    return "feature_b " + fault;
  }
  if (axis.kind == AxisKind::kFlat || axis.kind == AxisKind::kGeneral) {
    return RoundedFault(scene, axis);
  }
  std::string fault = "agrees with no direction of its kind";
  for (const IntegerVector& n : Candidates(scene, axis)) {
    if (!Agrees(n, axis.direction)) continue;
    fault = ExactFault(scene, n, relation, axis);
    if (fault.empty()) break;
  }
  return fault;
}

}  // namespace

testing::AssertionResult AxisIsValid(const Hull& a, const Pose& X_WA, const Hull& b,
                                     const Pose& X_WB, const Answer& answer) {
  const bool wanted = answer.relation != Relation::kOverlapping && !a.empty() && !b.empty();
  if (wanted != answer.axis.has_value()) {
    return testing::AssertionFailure()
           << (wanted ? "no axis, although " : "an axis, although ") << Name(answer.relation);
  }
  if (!wanted) return testing::AssertionSuccess();
  const Scene scene = {a, b,
                       oracle::PlaceInWorld(ToOracle(a.vertices()), ToOracle(X_WA),
                                            ToOracle(b.vertices()), ToOracle(X_WB))};
  const std::string fault = AxisFault(scene, answer.relation, *answer.axis);
  if (fault.empty()) return testing::AssertionSuccess();
  return testing::AssertionFailure()
         << "the " << Name(answer.relation) << " axis {" << answer.axis->direction.transpose()
         << "} of kind " << Name(answer.axis->kind) << " " << fault << "; feature_a "
         << testing::PrintToString(answer.axis->feature_a.vertices) << ", feature_b "
         << testing::PrintToString(answer.axis->feature_b.vertices);
}

}  // namespace hulld
