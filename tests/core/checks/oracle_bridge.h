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

// Convert types of core to those of the oracle.
std::vector<oracle::Point> ToOracle(std::span<const Vector> points);
oracle::Placement ToOracle(const Pose& pose);
oracle::ConvexHull ToOracle(const Hull& hull);
Relation FromOracle(oracle::Relation relation);

// Returns the oracle's relation of two hulls.
Relation OracleRelation(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB);

// Builds the hull of all points in one block; fails the test if refused.
Hull BuildHull(std::span<const Vector> points);

// True if two snapshots are bitwise equal.
testing::AssertionResult SameBits(const Hull& actual, const Hull& expected);

// True if a snapshot equals the oracle's canonical hull, with vertices, facets, and edges in order.
testing::AssertionResult SameHull(const Hull& actual, const oracle::ConvexHull& expected);

const char* Name(Relation relation);
const char* Name(AxisKind kind);

// Returns a failing query in hexadecimal floating point, sufficient to reproduce it.
std::string Describe(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_ORACLE_BRIDGE_H_
