#include "tests/core/checks/separation_check.h"

#include <cmath>
#include <limits>
#include <vector>

#include "tests/core/checks/oracle_bridge.h"
#include "tests/oracle/brute_force_separation.h"

namespace hulld {
namespace {

// A query in the oracle's types.
struct Query {
  std::vector<oracle::Point> a;
  oracle::Placement X_WA;
  std::vector<oracle::Point> b;
  oracle::Placement X_WB;
};

// Returns true if a world point is within `error` of the hull of the points.
bool IsNear(const std::vector<oracle::Point>& points, const oracle::Placement& pose,
            const Vector& p_W, double error) {
  const std::vector<oracle::Point> point = {{p_W.x(), p_W.y(), p_W.z()}};
  const oracle::Placement identity;
  if (oracle::BruteForceRelation(points, pose, point, identity) != oracle::Relation::kSeparated) {
    return true;
  }
  return oracle::Compare(oracle::BruteForceDistance(points, pose, point, identity), error) <= 0;
}

testing::AssertionResult WitnessIsValid(const Query& q, const Answer& answer) {
  const auto failure = [] { return testing::AssertionFailure() << "witness: "; };
  const Witness& witness = *answer.witness;
  if (!(witness.error >= 0)) return failure() << "no error";
  if (!IsNear(q.a, q.X_WA, witness.p_WA, witness.error)) return failure() << "off A";
  if (!IsNear(q.b, q.X_WB, witness.p_WB, witness.error)) return failure() << "off B";
  const double apart = (witness.p_WA - witness.p_WB).stableNorm();
  const double length = std::abs(answer.separation->value);
  const double slack =
      2 * witness.error + answer.separation->bound + 1e-15 * (apart + length) + 1e-320;
  if (!(std::abs(apart - length) <= slack)) {
    return failure() << apart << " apart, separation " << length << ", error " << witness.error;
  }
  return testing::AssertionSuccess();
}

// Returns true if separation <= clearance, by the oracle.
bool IsWithinClearance(Relation relation, const oracle::SquaredLength& length, double clearance) {
  if (relation == Relation::kTouching) return clearance >= 0;
  if (relation == Relation::kSeparated) {
    return clearance > 0 && (clearance == kInfinity || oracle::Compare(length, clearance) <= 0);
  }
  return clearance >= 0 || (clearance > -kInfinity && oracle::Compare(length, -clearance) >= 0);
}

bool SameMirrored(const Answer& ab, const Answer& ba) {
  return ab.relation == ba.relation && ab.separation->value == ba.separation->value &&
         ab.separation->bound == ba.separation->bound &&
         ab.within_clearance == ba.within_clearance && ab.witness->p_WA == ba.witness->p_WB &&
         ab.witness->p_WB == ba.witness->p_WA && ab.witness->error == ba.witness->error;
}

}  // namespace

QueryOptions WantSeparation(std::optional<double> max_error) {
  QueryOptions options;
  options.want_separation = true;
  options.want_witness = true;
  options.max_error = max_error;
  return options;
}

testing::AssertionResult SeparationCheck::Verify(const Hull& a, const Pose& X_WA, const Hull& b,
                                                 const Pose& X_WB,
                                                 std::optional<double> max_error) {
  const auto failure = [&] { return testing::AssertionFailure() << Describe(a, X_WA, b, X_WB); };
  const Query q = {ToOracle(a.vertices()), ToOracle(X_WA), ToOracle(b.vertices()), ToOracle(X_WB)};
  QueryOptions options = WantSeparation(max_error);
  const absl::StatusOr<Answer> answer = CheckCollision(a, X_WA, b, X_WB, options);
  if (!answer.ok()) return failure() << answer.status();
  const Relation relation = OracleRelation(a, X_WA, b, X_WB);
  if (answer->relation != relation) return failure() << "relation";
  ++queries_;
  ++relations_[static_cast<int>(relation)];
  const auto [value, bound] = *answer->separation;
  const int sign = (value > 0) - (value < 0);
  const int expected_sign = relation == Relation::kSeparated  ? 1
                            : relation == Relation::kTouching ? 0
                                                              : -1;
  if (sign != expected_sign) return failure() << Name(relation) << " at separation " << value;
  oracle::SquaredLength length{0, 1, 1, 1};
  if (relation == Relation::kSeparated) {
    length = oracle::BruteForceDistance(q.a, q.X_WA, q.b, q.X_WB);
  } else if (relation == Relation::kOverlapping) {
    length = oracle::BruteForceDepth(q.a, q.X_WA, q.b, q.X_WB);
  }
  if (!oracle::IsWithin(length, value, bound)) {
    return failure() << Name(relation) << ": separation " << value << " is not within " << bound;
  }
  const bool exact = bound <= 0x1p-51 * std::abs(value) + 0x1p-1073;
  ++(exact ? exact_ : float_);
  const double goal = max_error.value_or(
      2e-12 * (a.max_abs_coordinate() + b.max_abs_coordinate() + std::abs(value)));
  if (!exact && !(bound <= goal)) return failure() << "bound " << bound << " exceeds the goal";
  if (const auto result = WitnessIsValid(q, *answer); !result) return failure() << result.message();
  // Equal hulls at equal poses: the query is its own mirror image.
  const bool symmetric = X_WA.q == X_WB.q && X_WA.t == X_WB.t && SameBits(a, b);
  const double ulp = std::nextafter(std::abs(value), kInfinity) - std::abs(value);
  for (const double clearance : {value, value + ulp, value - ulp, value + 3 * bound,
                                 value - 3 * bound, 0.5 * value, -value, 0.0, kInfinity}) {
    options.clearance = clearance;
    const Answer cleared = CheckCollision(a, X_WA, b, X_WB, options).value();
    if (*cleared.within_clearance != IsWithinClearance(relation, length, clearance)) {
      return failure() << "clearance " << clearance << " at separation " << value;
    }
    if (cleared.separation->value != value) return failure() << "clearance moves the separation";
    if (!symmetric && !SameMirrored(cleared, CheckCollision(b, X_WB, a, X_WA, options).value())) {
      return failure() << "swapping the hulls changes the answer";
    }
  }
  return testing::AssertionSuccess();
}

}  // namespace hulld
