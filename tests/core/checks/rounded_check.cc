#include "tests/core/checks/rounded_check.h"

#include <cmath>
#include <string>
#include <vector>

#include "tests/core/checks/certificate_bridge.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/oracle/brute_force_separation.h"
#include "tests/oracle/certificate_check.h"

namespace hulld {
namespace {

// The separation of two cores: sign * length.
struct CoreSeparation {
  int sign = 0;
  oracle::SquaredLength length{0, 1, 1, 1};
};

CoreSeparation SeparationOfCores(const RoundedShape& a, const RoundedShape& b) {
  const std::vector<oracle::Point> points_a = ToOracle(a.hull.vertices());
  const std::vector<oracle::Point> points_b = ToOracle(b.hull.vertices());
  const oracle::Placement X_WA = ToOracle(a.X_WH);
  const oracle::Placement X_WB = ToOracle(b.X_WH);
  switch (oracle::BruteForceRelation(points_a, X_WA, points_b, X_WB)) {
    case oracle::Relation::kSeparated:
      return {1, oracle::BruteForceDistance(points_a, X_WA, points_b, X_WB)};
    case oracle::Relation::kOverlapping:
      return {-1, oracle::BruteForceDepth(points_a, X_WA, points_b, X_WB)};
    case oracle::Relation::kTouching:
      break;
  }
  return {};
}

oracle::Relation RelationOf(int sign) {
  return sign > 0    ? oracle::Relation::kSeparated
         : sign == 0 ? oracle::Relation::kTouching
                     : oracle::Relation::kOverlapping;
}

// Returns true if a world point is within `error` of the rounded shape.
bool IsNear(const RoundedShape& shape, const Vector& p_W, double error) {
  RoundedShape point;
  point.hull = BuildHull(std::vector<Vector>{p_W});
  const CoreSeparation distance = SeparationOfCores(shape, point);
  return oracle::CompareSum(distance.sign, distance.length, std::vector{shape.radius, error}) <= 0;
}

testing::AssertionResult WitnessIsValid(const RoundedShape& a, const RoundedShape& b,
                                        const Answer& answer) {
  const auto failure = [] { return testing::AssertionFailure() << "witness: "; };
  const Witness& witness = *answer.witness;
  if (!(witness.error >= 0)) return failure() << "no error";
  if (!IsNear(a, witness.p_WA, witness.error)) return failure() << "off A";
  if (!IsNear(b, witness.p_WB, witness.error)) return failure() << "off B";
  const Vector between = witness.p_WB - witness.p_WA;
  const double value = answer.separation->value;
  const double slack = 2 * witness.error + answer.separation->bound + 1e-15 * std::abs(value) +
                       std::abs(value) * answer.normal->angle_bound + 1e-320;
  if (!((between - value * answer.normal->direction).stableNorm() <= slack)) {
    return failure() << "between: " << between.transpose() << ", separation " << value
                     << ", normal " << answer.normal->direction.transpose();
  }
  return testing::AssertionSuccess();
}

QueryOptions Everything() {
  QueryOptions options;
  options.want_axis = options.want_analysis = options.want_certificate = true;
  options.want_separation = options.want_witness = options.want_normal = true;
  return options;
}

testing::AssertionResult CertificateIsValid(const RoundedShape& a, const RoundedShape& b,
                                            const Answer& answer, oracle::Relation relation) {
  if (!answer.certificate) return testing::AssertionFailure() << "no certificate";
  const std::string fault = oracle::FaultOfRounded(
      ToOracle(*answer.certificate), relation, ToOracle(a.hull.vertices()), ToOracle(a.X_WH),
      ToOracle(b.hull.vertices()), ToOracle(b.X_WH), std::vector{a.radius, b.radius});
  if (fault.empty()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "certificate: " << fault;
}

// Checks clearances at and next to the separation.
testing::AssertionResult ClearancesAreExact(const RoundedShape& a, const RoundedShape& b,
                                            const CoreSeparation& cores, double value) {
  for (const double clearance : {value, std::nextafter(value, kInfinity),
                                 std::nextafter(value, -kInfinity), 0.5 * value, -value, 0.0}) {
    QueryOptions options;
    options.clearance = clearance;
    const bool within = oracle::CompareSum(cores.sign, cores.length,
                                           std::vector{a.radius, b.radius, clearance}) <= 0;
    for (const bool swapped : {false, true}) {
      const Answer answer =
          (swapped ? CheckRounded(b, a, options) : CheckRounded(a, b, options)).value();
      if (*answer.within_clearance != within) {
        return testing::AssertionFailure()
               << "clearance " << clearance << " at separation " << value;
      }
    }
  }
  return testing::AssertionSuccess();
}

}  // namespace

absl::StatusOr<Answer> CheckRounded(const RoundedShape& a, const RoundedShape& b,
                                    const QueryOptions& options, PairCache* cache) {
  const QueryHull hull_a(a.hull);
  const QueryHull hull_b(b.hull);
  return CheckCollision(PlacedHull(hull_a, a.X_WH, a.radius), PlacedHull(hull_b, b.X_WH, b.radius),
                        options, cache);
}

testing::AssertionResult RoundedCheck::Verify(const RoundedShape& a, const RoundedShape& b) {
  const auto failure = [&] {
    return testing::AssertionFailure() << Describe(a.hull, a.X_WH, b.hull, b.X_WH) << " radii "
                                       << a.radius << " " << b.radius << ": ";
  };
  const CoreSeparation cores = SeparationOfCores(a, b);
  const std::vector<double> radii = {a.radius, b.radius};
  const int sign = oracle::CompareSum(cores.sign, cores.length, radii);
  const Relation relation = FromOracle(RelationOf(sign));
  ++relations_[static_cast<size_t>(relation)];
  if (cores.sign <= 0) ++meeting_cores_;

  PairCache cache;
  for (const auto& answer : {CheckRounded(a, b), CheckRounded(b, a), CheckRounded(a, b, {}, &cache),
                             CheckRounded(a, b, {}, &cache)}) {
    if (!answer.ok()) return failure() << answer.status();
    if (answer->relation != relation) return failure() << Name(answer->relation);
    ++rungs_[static_cast<size_t>(answer->rung)];
  }
  const absl::StatusOr<Answer> answer = CheckRounded(a, b, Everything());
  if (!answer.ok()) return failure() << answer.status();
  if (answer->relation != relation) return failure() << "details: " << Name(answer->relation);
  const auto [value, bound] = *answer->separation;
  if ((value > 0) - (value < 0) != sign) return failure() << "separation " << value;
  for (const int side : {-1, 1}) {
    const std::vector<double> terms = {a.radius, b.radius, value, side * bound};
    if (side * oracle::CompareSum(cores.sign, cores.length, terms) > 0) {
      return failure() << "separation " << value << " is not within " << bound;
    }
  }
  const double goal = 2e-12 * (a.hull.max_abs_coordinate() + b.hull.max_abs_coordinate() +
                               a.radius + b.radius + std::abs(value)) +
                      0x1p-1073;
  if (!(bound <= goal)) return failure() << "bound " << bound << " exceeds the goal";
  if (answer->axis.has_value() != (sign >= 0)) return failure() << "axis";
  if (auto result = WitnessIsValid(a, b, *answer); !result) return failure() << result.message();
  if (auto result = CertificateIsValid(a, b, *answer, RelationOf(sign)); !result) {
    return failure() << result.message();
  }
  if (auto result = ClearancesAreExact(a, b, cores, value); !result) {
    return failure() << result.message();
  }
  const Answer mirrored = CheckRounded(b, a, Everything()).value();
  if (mirrored.separation->value != value || mirrored.separation->bound != bound) {
    return failure() << "swapped: separation " << mirrored.separation->value;
  }
  return testing::AssertionSuccess();
}

}  // namespace hulld
