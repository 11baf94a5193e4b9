#ifndef HULLD_TESTS_CORE_CHECKS_ORACLE_BRIDGE_H_
#define HULLD_TESTS_CORE_CHECKS_ORACLE_BRIDGE_H_

#include <gtest/gtest.h>

#include <span>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/collision.h"
#include "core/query/terms/pose.h"
#include "tests/oracle/brute_force_hull.h"
#include "tests/oracle/brute_force_relation.h"

namespace hulld {

// Between the types of core and those of the oracle.
std::vector<oracle::Point> ToOracle(std::span<const Vector> points);
oracle::Placement ToOracle(const Pose& pose);
oracle::ConvexHull ToOracle(const Hull& hull);
Relation FromOracle(oracle::Relation relation);

// The oracle's relation of two hulls.
Relation OracleRelation(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB);

// The hull of all points in one block; a failure of the test when refused.
Hull BuildHull(std::span<const Vector> points);

// Whether two snapshots hold the same bits.
testing::AssertionResult SameBits(const Hull& actual, const Hull& expected);

// Whether a snapshot equals the oracle's canonical hull, vertices, facets and edges in order.
testing::AssertionResult SameHull(const Hull& actual, const oracle::ConvexHull& expected);

const char* Name(Relation relation);
const char* Name(AxisKind kind);

// All that a failing question needs to be asked again, in hexadecimal floating point.
std::string Describe(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_ORACLE_BRIDGE_H_
