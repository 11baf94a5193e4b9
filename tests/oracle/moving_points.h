#ifndef HULLD_TESTS_ORACLE_MOVING_POINTS_H_
#define HULLD_TESTS_ORACLE_MOVING_POINTS_H_

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/oracle/brute_force_relation.h"

namespace hulld::oracle {

using Rational = boost::multiprecision::number<boost::multiprecision::cpp_rational_backend,
                                               boost::multiprecision::et_off>;

// q(t) = (1 - t) q0 + t q1 and x(t) = (1 - t) x0 + t x1 for t in [0, 1].
struct Motion {
  Placement start;
  Placement end;
};

// Points, their motion, and the radius of a ball around each. The points are at a pose in the frame
// that moves.
struct MovingPoints {
  std::span<const Point> points;
  Motion motion;
  double radius = 0;
  Placement in_frame = {};
};

// Returns both point sets at a time, directly from the definition.
WorldPoints PlaceInWorldAt(const MovingPoints& a, const MovingPoints& b, const Rational& time);
// Returns the relation of their hulls, without radii, at a time.
Relation RelationAt(const MovingPoints& a, const MovingPoints& b, const Rational& time);

// The first contact of two translations, and the strongest relation over all times.
struct TranslationContact {
  Relation relation = Relation::kSeparated;
  std::optional<Rational> first;
};

// Tries every event time in [0, 1]: 0, 1, and each time at which the origin crosses the plane of
// three points of A - B, the line of two, or a point. The origin enters the hull of A - B at one of
// these, and is inside between two of them if at all. For at most about 30 differences.
TranslationContact BruteForceTranslation(const MovingPoints& a, const MovingPoints& b);

// A proof of separation from the end of the previous interval on.
struct SeparatedInterval {
  Rational until;
  std::array<Rational, 3> direction;
  std::optional<Rational> offset;
  // With an offset: direction and offset at `until`, linear in between.
  std::array<Rational, 3> end_direction = direction;
  std::optional<Rational> end_offset = offset;
};

// Returns the defect of intervals that should prove separation from 0 to `until`, or an empty
// string. With an offset: the Bernstein coefficients of |q(t)|^2 (n.p(t) - offset) of every point,
// by interpolation at five times, with the offset moved by the radius times |n| at the end at which
// n is longer, rounded up.
// Without one, and without radii: n.(b - a) at both ends, where 0 is allowed at the last end if the
// pair meets.
std::string FaultOf(const MovingPoints& a, const MovingPoints& b,
                    std::span<const SeparatedInterval> intervals, const Rational& until,
                    bool meets);

// Returns the defect of a proof that two translations meet at some time between two, or an empty
// string: 0 is in the hull of the differences of at most four pairs at both times.
std::string FaultOfBriefContact(const MovingPoints& a, const MovingPoints& b, const Rational& from,
                                const Rational& until,
                                std::span<const std::pair<uint32_t, uint32_t>> pairs);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_MOVING_POINTS_H_
