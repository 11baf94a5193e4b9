#ifndef HULLD_TESTS_CORE_QUERY_MOTION_MOTION_CHECK_H_
#define HULLD_TESTS_CORE_QUERY_MOTION_MOTION_CHECK_H_

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/motion/first_contact.h"
#include "core/query/placed/query_hull.h"
#include "core/query/terms/pose.h"
#include "tests/core/checks/certificate_bridge.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/oracle/moving_points.h"

namespace hulld {

// A hull or piece in motion that owns its hull, and its points for the oracle.
class OwnMoving {
 public:
  OwnMoving(const std::vector<Vector>& points, const Motion& motion, double radius = 0,
            const Pose& X_BH = {})
      : hull_(std::make_unique<Hull>(BuildHull(points))),
        query_(std::make_unique<QueryHull>(*hull_)),
        motion_(motion),
        radius_(radius),
        X_BH_(X_BH),
        vertices_(ToOracle(hull_->vertices())) {}

  MovingHull moving() const { return {*query_, motion_, radius_, X_BH_}; }
  oracle::MovingPoints ForOracle() const {
    return {vertices_, {ToOracle(motion_.start), ToOracle(motion_.end)}, radius_, ToOracle(X_BH_)};
  }

 private:
  std::unique_ptr<Hull> hull_;
  std::unique_ptr<QueryHull> query_;
  Motion motion_;
  double radius_;
  Pose X_BH_;
  std::vector<oracle::Point> vertices_;
};

inline Vector LatticeVector(Random& random, int most) {
  return {static_cast<double>(random.Between(-most, most)),
          static_cast<double>(random.Between(-most, most)),
          static_cast<double>(random.Between(-most, most))};
}

// Returns a random pose of a piece: one of a few rotations with quaternions of any length, and a
// lattice vector.
inline Pose LatticePiecePose(Random& random, int most) {
  constexpr std::array<std::array<double, 4>, 6> kRotations = {
      {{1, 1, 0, 0}, {1, 2, 2, 0}, {0, 3, 0, 4}, {2, 0, -1, 1}, {-3, 0, 0, 0}, {1, -1, 1, 1}}};
  return {kRotations[random.Below(kRotations.size())], LatticeVector(random, most)};
}

// Returns a random pose with a rotation about any axis.
inline Pose RandomPose(Random& random, double length) {
  Pose pose;
  for (double& component : pose.q) component = random.Real(-1, 1);
  for (int i = 0; i < 3; ++i) pose.t[i] = random.Real(-length, length);
  return pose;
}

// Succeeds if the bracket is the first time itself, if that is a double, or otherwise the doubles
// around it.
inline testing::AssertionResult IsBracketOf(const FirstContact& contact,
                                            const oracle::Rational& first) {
  if (!contact.contact_time) return testing::AssertionFailure() << "no contact";
  const oracle::Rational low(contact.separated_until);
  const oracle::Rational high(*contact.contact_time);
  if (low == first && high == first) return testing::AssertionSuccess();
  const bool adjacent = std::nextafter(contact.separated_until, 2.0) == *contact.contact_time;
  if (low < first && first < high && adjacent) return testing::AssertionSuccess();
  return testing::AssertionFailure() << contact.separated_until << " .. " << *contact.contact_time
                                     << " is not around " << first;
}

// Converts intervals for the oracle.
inline std::vector<oracle::SeparatedInterval> ToOracle(
    const std::vector<SeparatedInterval>& intervals) {
  std::vector<oracle::SeparatedInterval> result;
  for (const SeparatedInterval& interval : intervals) {
    oracle::SeparatedInterval copy;
    copy.until = oracle::Rational(interval.until);
    for (int i = 0; i < 3; ++i) {
      if (const Vector* n = std::get_if<Vector>(&interval.direction)) {
        copy.direction[i] = oracle::Rational((*n)[i]);
      } else {
        copy.direction[i] =
            oracle::Rational(oracle::Integer(std::get<IntegerVector>(interval.direction)[i]));
      }
    }
    if (interval.offset) copy.offset = oracle::Rational(*interval.offset);
    copy.end_direction = copy.direction;
    copy.end_offset = copy.offset;
    if (interval.end) {
      for (int i = 0; i < 3; ++i)
        copy.end_direction[i] = oracle::Rational(interval.end->direction[i]);
      copy.end_offset = oracle::Rational(interval.end->offset);
    }
    result.push_back(copy);
  }
  return result;
}

// Succeeds if the certificate proves the answer in the oracle's arithmetic: the separation up to
// separated_until, and the contact at contact_time.
inline testing::AssertionResult ContactIsProven(const OwnMoving& a, const OwnMoving& b,
                                                const FirstContact& contact) {
  const oracle::MovingPoints points_a = a.ForOracle();
  const oracle::MovingPoints points_b = b.ForOracle();
  const bool meets = contact.contact_time.has_value();
  const std::string fault = oracle::FaultOf(points_a, points_b, ToOracle(contact.intervals),
                                            oracle::Rational(contact.separated_until), meets);
  if (!fault.empty()) return testing::AssertionFailure() << fault;
  if (meets != contact.certificate.has_value()) {
    return testing::AssertionFailure() << "a contact without a certificate, or the reverse";
  }
  if (!meets) return testing::AssertionSuccess();
  // Certificates of rounded hulls are checked by other tests of core.
  if (points_a.radius > 0 || points_b.radius > 0) return testing::AssertionSuccess();
  const oracle::WorldPoints world =
      oracle::PlaceInWorldAt(points_a, points_b, oracle::Rational(*contact.contact_time));
  const oracle::Certificate certificate = ToOracle(*contact.certificate);
  const std::string contact_fault = oracle::FaultOf(
      certificate,
      certificate.direction.empty() ? oracle::Relation::kOverlapping : oracle::Relation::kTouching,
      world);
  if (contact_fault.empty()) return testing::AssertionSuccess();
  const std::string brief_fault =
      oracle::FaultOfBriefContact(points_a, points_b, oracle::Rational(contact.separated_until),
                                  oracle::Rational(*contact.contact_time), certificate.pairs);
  if (brief_fault.empty()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << contact_fault << "; " << brief_fault;
}

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_QUERY_MOTION_MOTION_CHECK_H_
