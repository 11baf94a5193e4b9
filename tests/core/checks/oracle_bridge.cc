#include "tests/core/checks/oracle_bridge.h"

#include <bit>
#include <cstdint>
#include <ios>
#include <sstream>
#include <utility>

#include "core/hull/growth/hull_builder.h"

namespace hulld {
namespace {

void Print(std::ostream& out, const Vector& p) {
  out << "{" << p.x() << ", " << p.y() << ", " << p.z() << "}";
}

void Print(std::ostream& out, const Hull& hull, const Pose& pose) {
  out << std::hexfloat << "vertices {";
  const size_t shown = std::min<size_t>(hull.vertices().size(), 16);
  for (size_t i = 0; i < shown; ++i) {
    if (i > 0) out << ", ";
    Print(out, hull.vertices()[i]);
  }
  if (shown < hull.vertices().size()) out << ", ... " << hull.vertices().size() << " in all";
  out << "} q {" << pose.q[0] << ", " << pose.q[1] << ", " << pose.q[2] << ", " << pose.q[3]
      << "} t ";
  Print(out, pose.t);
  out << "\n";
}

}  // namespace

std::vector<oracle::Point> ToOracle(std::span<const Vector> points) {
  std::vector<oracle::Point> result;
  for (const Vector& p : points) result.push_back({p.x(), p.y(), p.z()});
  return result;
}

oracle::Placement ToOracle(const Pose& pose) {
  return {pose.q, {pose.t.x(), pose.t.y(), pose.t.z()}};
}

oracle::ConvexHull ToOracle(const Hull& hull) {
  oracle::ConvexHull result;
  result.dimension = hull.dimension();
  result.vertices = ToOracle(hull.vertices());
  for (size_t i = 0; i < hull.facet_count(); ++i) {
    result.facets.emplace_back(hull.facet(i).begin(), hull.facet(i).end());
  }
  for (const Edge& edge : hull.edges()) result.edges.emplace_back(edge.tail, edge.head);
  return result;
}

Relation FromOracle(oracle::Relation relation) {
  switch (relation) {
    case oracle::Relation::kSeparated:
      return Relation::kSeparated;
    case oracle::Relation::kTouching:
      return Relation::kTouching;
    case oracle::Relation::kOverlapping:
      break;
  }
  return Relation::kOverlapping;
}

Relation OracleRelation(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB) {
  return FromOracle(oracle::BruteForceRelation(ToOracle(a.vertices()), ToOracle(X_WA),
                                               ToOracle(b.vertices()), ToOracle(X_WB)));
}

Hull BuildHull(std::span<const Vector> points) {
  HullBuilder builder;
  const absl::StatusOr<PointCounts> counts = builder.Add(points);
  EXPECT_TRUE(counts.ok()) << counts.status();
  return builder.Snapshot();
}

testing::AssertionResult SameBits(const Hull& actual, const Hull& expected) {
  const oracle::ConvexHull a = ToOracle(actual);
  const oracle::ConvexHull b = ToOracle(expected);
  if (a.vertices.size() != b.vertices.size()) {
    return testing::AssertionFailure()
           << a.vertices.size() << " vertices, not " << b.vertices.size();
  }
  for (size_t i = 0; i < a.vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      // Compares bits, because -0 == 0.
      if (std::bit_cast<uint64_t>(a.vertices[i][k]) != std::bit_cast<uint64_t>(b.vertices[i][k])) {
        return testing::AssertionFailure() << "vertex " << i << " coordinate " << k << " differs";
      }
    }
  }
  if (!(a == b))
    return testing::AssertionFailure() << "same vertices, but different facets or edges";
  if (actual.max_abs_coordinate() != expected.max_abs_coordinate()) {
    return testing::AssertionFailure() << "max_abs_coordinate differs";
  }
  return testing::AssertionSuccess();
}

testing::AssertionResult SameHull(const Hull& actual, const oracle::ConvexHull& expected) {
  const oracle::ConvexHull hull = ToOracle(actual);
  if (hull == expected) return testing::AssertionSuccess();
  testing::AssertionResult failure = testing::AssertionFailure();
  failure << "expected dimension " << expected.dimension << ", vertices "
          << testing::PrintToString(expected.vertices) << ", facets "
          << testing::PrintToString(expected.facets) << ", edges "
          << testing::PrintToString(expected.edges) << "\nactual dimension " << hull.dimension;
  if (hull.vertices != expected.vertices) {
    failure << ", vertices " << testing::PrintToString(hull.vertices);
  }
  if (hull.facets != expected.facets) failure << ", facets " << testing::PrintToString(hull.facets);
  if (hull.edges != expected.edges) failure << ", edges " << testing::PrintToString(hull.edges);
  return failure;
}

const char* Name(Relation relation) {
  switch (relation) {
    case Relation::kSeparated:
      return "SEPARATED";
    case Relation::kTouching:
      return "TOUCHING";
    case Relation::kOverlapping:
      return "OVERLAPPING";
    case Relation::kWithinTolerance:
      break;
  }
  return "WITHIN_TOLERANCE";
}

const char* Name(AxisKind kind) {
  switch (kind) {
    case AxisKind::kFacetA:
      return "FACET_A";
    case AxisKind::kFacetB:
      return "FACET_B";
    case AxisKind::kEdgeEdge:
      return "EDGE_EDGE";
    case AxisKind::kFlat:
      return "FLAT";
    case AxisKind::kGeneral:
      break;
  }
  return "GENERAL";
}

std::string Describe(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB) {
  std::ostringstream out;
  out << "A: ";
  Print(out, a, X_WA);
  out << "B: ";
  Print(out, b, X_WB);
  return out.str();
}

}  // namespace hulld
