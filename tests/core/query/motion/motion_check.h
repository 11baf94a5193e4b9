#ifndef HULLD_TESTS_CORE_QUERY_MOTION_MOTION_CHECK_H_
#define HULLD_TESTS_CORE_QUERY_MOTION_MOTION_CHECK_H_

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/motion/first_contact.h"
#include "core/query/placed/query_hull.h"
#include "tests/core/checks/certificate_bridge.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/oracle/moving_points.h"

namespace hulld {

// A hull in motion that owns its hull and its points for the oracle.
class OwnMoving {
 public:
  OwnMoving(const std::vector<Vector>& points, const Motion& motion, double radius = 0)
      : hull_(std::make_unique<Hull>(BuildHull(points))),
        query_(std::make_unique<QueryHull>(*hull_)),
        motion_(motion),
        radius_(radius),
        vertices_(ToOracle(hull_->vertices())) {}

  MovingHull moving() const { return {*query_, motion_, radius_}; }
  oracle::MovingPoints ForOracle() const {
    return {vertices_, {ToOracle(motion_.start), ToOracle(motion_.end)}, radius_};
  }

 private:
  std::unique_ptr<Hull> hull_;
  std::unique_ptr<QueryHull> query_;
  Motion motion_;
  double radius_;
  std::vector<oracle::Point> vertices_;
};

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
    result.push_back(copy);
  }
  return result;
}

// True if an answer with a certificate is proven by it, in the oracle's arithmetic: the separation
// up to separated_until, and the contact at contact_time.
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
  // Tests of core check certificates of rounded hulls.
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
