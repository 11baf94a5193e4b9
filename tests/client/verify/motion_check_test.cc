#include "client/verify/motion_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/oracle/brute_force_relation.h"
#include "tests/test_size.h"

namespace hulld {
namespace motion_check_test {

using ::testing::HasSubstr;

constexpr v1::Relation kSeparated = v1::RELATION_SEPARATED;
constexpr v1::Relation kTouching = v1::RELATION_TOUCHING;
constexpr v1::Relation kOverlapping = v1::RELATION_OVERLAPPING;
constexpr double kDefaultWidth = 0x1p-30;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Numbers = std::vector<double>;

// Quaternion w x y z, translation x y z.
v1::Pose PoseOf(const Numbers& q, const Numbers& x) {
  v1::Pose pose;
  pose.mutable_rotation()->set_w(q[0]);
  pose.mutable_rotation()->set_x(q[1]);
  pose.mutable_rotation()->set_y(q[2]);
  pose.mutable_rotation()->set_z(q[3]);
  pose.mutable_translation()->set_x(x[0]);
  pose.mutable_translation()->set_y(x[1]);
  pose.mutable_translation()->set_z(x[2]);
  return pose;
}

const Numbers kNoTurn = {1, 0, 0, 0};

struct Moving {
  Numbers xyz;
  v1::Pose start;
  v1::Pose end;
  double radius = 0;
  std::optional<v1::Pose> in_body = std::nullopt;
};

Moving Shifted(Numbers xyz, const Numbers& from, const Numbers& to) {
  return {std::move(xyz), PoseOf(kNoTurn, from), PoseOf(kNoTurn, to)};
}
Moving Resting(Numbers xyz) { return Shifted(std::move(xyz), {0, 0, 0}, {0, 0, 0}); }
Moving Rounded(Moving moving, double radius) {
  moving.radius = radius;
  return moving;
}
Moving Turned(Numbers xyz, const Numbers& from, const Numbers& to) {
  return {std::move(xyz), PoseOf(from, {0, 0, 0}), PoseOf(to, {0, 0, 0})};
}

// Vertex 4 i + 2 j + k takes its coordinates from low (0) or high (1).
Numbers Box(const Numbers& low, const Numbers& high) {
  Numbers xyz;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      xyz.push_back(((corner >> (2 - axis)) & 1) != 0 ? high[axis] : low[axis]);
    }
  }
  return xyz;
}
Numbers Cube() { return Box({0, 0, 0}, {1, 1, 1}); }
Numbers Octahedron() { return {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1}; }

template <typename Proof>
void SetDirection(const Numbers& n, Proof* proof) {
  proof->mutable_direction()->set_x(n[0]);
  proof->mutable_direction()->set_y(n[1]);
  proof->mutable_direction()->set_z(n[2]);
}

// A claim about a motion, built step by step.
struct Claim {
  v1::Relation relation;
  v1::FirstContact contact = {};
  v1::Certificate certificate = {};
  double width = kDefaultWidth;

  Claim& Until(double until, const Numbers& n) {
    v1::SeparatedInterval* const interval = contact.add_intervals();
    interval->set_until(until);
    SetDirection(n, interval);
    contact.set_separated_until(until);
    return *this;
  }
  Claim& Until(double until, const Numbers& n, double offset) {
    Until(until, n).contact.mutable_intervals()->rbegin()->set_offset(offset);
    return *this;
  }
  // Moves the end of the last plane.
  Claim& To(const Numbers& n, double offset) {
    v1::Vector3* const end = Last().mutable_end_direction();
    end->set_x(n[0]);
    end->set_y(n[1]);
    end->set_z(n[2]);
    Last().set_end_offset(offset);
    return *this;
  }
  Claim& Contact(double time) {
    contact.set_contact_time(time);
    return *this;
  }
  Claim& Pairs(const std::vector<std::pair<uint32_t, uint32_t>>& pairs) {
    for (const auto& [a, b] : pairs) {
      v1::VertexPair* const pair = certificate.add_pairs();
      pair->set_index_a(a);
      pair->set_index_b(b);
    }
    return *this;
  }
  Claim& Touching(double time, const Numbers& n, uint32_t a, uint32_t b) {
    SetDirection(n, &certificate);
    return Contact(time).Pairs({{a, b}});
  }
  v1::SeparatedInterval& Last() { return *contact.mutable_intervals()->rbegin(); }
};

Claim Separated() { return {kSeparated}; }
Claim Touches() { return {kTouching}; }
Claim Overlaps() { return {kOverlapping}; }

absl::Status Check(const Claim& claim, const Moving& a, const Moving& b) {
  const auto moving = [](const Moving& of) -> MovingVertices {
    const v1::Pose* const in_body = of.in_body ? &*of.in_body : nullptr;
    return {{of.xyz, of.start, in_body, false, {of.radius}}, of.end};
  };
  return CheckFirstContact(claim.relation, claim.contact, claim.certificate, moving(a), moving(b),
                           claim.width);
}

void ExpectValid(const Claim& claim, const Moving& a, const Moving& b) {
  const absl::Status status = Check(claim, a, b);
  EXPECT_TRUE(status.ok()) << status.ToString();
}

void ExpectInvalid(const Claim& claim, const Moving& a, const Moving& b, const std::string& why) {
  const absl::Status status = Check(claim, a, b);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr(why));
}

// The cube at rest, and the same cube that comes along x from `from` to `to`.
const Moving kCube = Resting(Cube());
Moving Coming(double from, double to) { return Shifted(Cube(), {from, 0, 0}, {to, 0, 0}); }

TEST(MotionCheck, ADirectionAloneProvesATranslation) {
  ExpectValid(Separated().Until(1, {1, 0, 0}), kCube, Coming(3, std::nextafter(1.0, 2.0)));
  ExpectValid(Separated().Until(0.25, {1, 0.5, 0}).Until(1, {1, 0, 0}), kCube, Coming(3, 1.5));
  ExpectInvalid(Separated().Until(1, {1, 0, 0}), kCube, Coming(3, 1), "separate at both ends");
  ExpectInvalid(Separated().Until(1, {1, 0, 0}), kCube, Coming(1, 3), "separate at both ends");
  ExpectInvalid(Separated().Until(1, {-1, 0, 0}), kCube, Coming(3, 2), "separate at both ends");
  ExpectInvalid(Separated().Until(0.75, {1, 0, 0}).Until(1, {0, 1, 0}), kCube, Coming(3, 2),
                "intervals[1]: the direction does not separate");
}

TEST(MotionCheck, BothHullsMayMove) {
  const Moving away = Shifted(Cube(), {0, 0, 0}, {-4, 2, 0});
  ExpectValid(Separated().Until(1, {1, 0, 0}), away, Coming(2, -2));
  ExpectInvalid(Separated().Until(1, {1, 0, 0}), away, Coming(2, -3), "separate at both ends");
}

TEST(MotionCheck, ATranslationMeetsAtTheExactTime) {
  // It reaches x = 1 at half time.
  const Moving b = Coming(3, -1);
  const auto claim = [](double until, double contact) {
    return Overlaps().Until(until, {1, 0, 0}).Touching(contact, {1, 0, 0}, 4, 0);
  };
  ExpectValid(claim(0.5, 0.5), kCube, b);
  ExpectValid(claim(std::nextafter(0.5, 0.0), 0.5), kCube, b);
  ExpectInvalid(claim(0.5, std::nextafter(0.5, 1.0)), kCube, b, "contact: the direction");
  ExpectInvalid(claim(std::nextafter(0.5, 1.0), std::nextafter(0.5, 1.0)), kCube, b,
                "separate at both ends");
  ExpectInvalid(claim(std::nextafter(0.5, 0.0), std::nextafter(0.5, 0.0)), kCube, b, "0 is not in");
}

TEST(MotionCheck, AdjacentDoublesBracketATimeThatIsNotADouble) {
  // The point reaches x = 1 at a third of the time.
  const Moving a = Resting(Octahedron());
  const Moving b = Shifted({0, 0, 0}, {2, 0, 0}, {-1, 0, 0});
  const double below = 1.0 / 3;
  const double above = std::nextafter(below, 1.0);
  const auto claim = [](double until, double contact) {
    return Overlaps()
        .Until(until, {1, 0, 0})
        .Contact(contact)
        .Pairs({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}});
  };
  ExpectValid(claim(below, above), a, b);
  ExpectInvalid(claim(above, above), a, b, "separate at both ends");
  ExpectInvalid(claim(below, below), a, b, "contact: the certificate has 6 vertex pairs");
  Claim grazes = claim(below, above);
  grazes.relation = kTouching;
  ExpectInvalid(grazes, a, b, "they do not merely touch");
}

TEST(MotionCheck, AGrazeNeverOverlaps) {
  // It slides along the upper side from half time on.
  const Moving b = Shifted(Cube(), {-3, 1, 0}, {1, 1, 0});
  const Claim claim = Touches().Until(0.5, {-1, 0, 0});
  ExpectValid(Claim(claim).Touching(0.5, {0, 1, 0}, 2, 4), kCube, b);
  ExpectInvalid(Claim(claim).Touching(0.5, {0, 1, 0}, 0, 4), kCube, b, "0 is not in the hull");
  ExpectInvalid(Claim(claim).Touching(0.5, {0, -1, 0}, 2, 4), kCube, b, "max n.A > min n.B");
  // Contact at the last moment is a graze as well.
  ExpectValid(Touches().Until(1, {1, 0, 0}).Touching(1, {1, 0, 0}, 4, 0), kCube, Coming(3, 1));
}

TEST(MotionCheck, AContactMayEndBeforeTheNextDouble) {
  // Two points meet at a third of the time, and a segment with the octahedron's corner.
  const double below = 1.0 / 3;
  const double above = std::nextafter(below, 1.0);
  const auto claim = [](double until, double contact) {
    return Touches().Until(until, {1, 0, 0}).Contact(contact).Pairs({{0, 0}});
  };
  const Moving a = Resting({1, 0, 0});
  const Moving b = Shifted({0, 0, 0}, {2, 0, 0}, {-1, 0, 0});
  ExpectValid(claim(below, above), a, b);
  ExpectInvalid(claim(below, below), a, b, "no common point up to contact_time");
  ExpectInvalid(claim(below, above), a, Shifted({0, 0, 0}, {2, 0, 1e-300}, {-1, 0, 1e-300}),
                "no common point up to contact_time");
  const Moving needle = Shifted({0, -1, 0, 0, 1, 0}, {2, 0, 0}, {-1, 0, 0});
  ExpectValid(claim(below, above).Pairs({{0, 1}}), Resting(Octahedron()), needle);
  ExpectInvalid(claim(below, above), Resting(Octahedron()), needle, "no common point");
}

TEST(MotionCheck, ContactAtTheStartNeedsNoInterval) {
  ExpectValid(Touches().Touching(0, {1, 0, 0}, 4, 0), kCube, Coming(1, 3));
  ExpectValid(Overlaps().Touching(0, {1, 0, 0}, 4, 0), kCube, Coming(1, 0.5));
  ExpectInvalid(Touches().Until(0, {1, 0, 0}).Touching(0, {1, 0, 0}, 4, 0), kCube, Coming(1, 3),
                "intervals[0] ends at 0, not between 0 and 0");
}

// A rod of length 5 that turns about z: q(t) = (1, 0, 0, t), so that its tip is at (3, 4, 0) at
// half time, where it touches a box above y = 4.
const Numbers kRod = {0, 0, 0, 5, 0, 0};
const Moving kTurningRod = Turned(kRod, kNoTurn, {1, 0, 0, 1});
const Moving kCeiling = Resting(Box({0, 4, -1}, {6, 5, 1}));

Claim RodMeets() {
  const double until = 0.5 - 0x1p-31;
  return Touches()
      .Until(0.25, {0, -1, 0}, -3)
      .Until(until, {0, -1, 0}, -(4 - 0x1p-30))
      .Contact(0.5)
      .Pairs({{0, 1}, {4, 1}});
}

Claim RodTouches(const Numbers& n = {0, -1, 0}) {
  Claim claim = RodMeets();
  claim.certificate.mutable_pairs(0)->set_index_a(1);
  claim.Pairs({{5, 1}});
  SetDirection(n, &claim.certificate);
  return claim;
}

TEST(MotionCheck, PlanesProveARotation) {
  ExpectValid(RodTouches(), kCeiling, kTurningRod);
  // The end of the rod that is at rest is not part of the contact.
  Claim other = RodTouches();
  other.certificate.mutable_pairs(0)->set_index_b(0);
  other.certificate.mutable_pairs(1)->set_index_b(0);
  other.certificate.mutable_pairs(2)->set_index_b(0);
  ExpectInvalid(other, kCeiling, kTurningRod, "contact: the vertex pairs");
  ExpectInvalid(RodTouches({0, 1, 0}), kCeiling, kTurningRod, "contact: the direction");
}

TEST(MotionCheck, PlanesAreExact) {
  Claim claim = RodTouches();
  // The tip is at y = 2 1/3 + 1/51 at a quarter of the time.
  claim.contact.mutable_intervals(0)->set_offset(-2.3529411764705883);
  ExpectValid(claim, kCeiling, kTurningRod);
  claim.contact.mutable_intervals(0)->set_offset(std::nextafter(-2.3529411764705883, 0));
  ExpectInvalid(claim, kCeiling, kTurningRod, "intervals[0]: B does not stay");
  claim.contact.mutable_intervals(0)->set_offset(-4);
  ExpectInvalid(claim, kCeiling, kTurningRod, "intervals[0]: A does not stay");
  claim.contact.mutable_intervals(0)->set_offset(std::nextafter(-4.0, 0.0));
  ExpectValid(claim, kCeiling, kTurningRod);
}

TEST(MotionCheck, DirectionAndOffsetHaveTheSameScale) {
  for (const double scale : {3.0, 0x1p-1000, 0x1p900}) {
    Claim claim = RodTouches();
    for (v1::SeparatedInterval& interval : *claim.contact.mutable_intervals()) {
      interval.mutable_direction()->set_y(scale * interval.direction().y());
      interval.set_offset(scale * interval.offset());
    }
    ExpectValid(claim, kCeiling, kTurningRod);
    claim.Last().set_offset(claim.Last().offset() / 2);
    ExpectInvalid(claim, kCeiling, kTurningRod, "B does not stay");
  }
  Claim claim = RodTouches();
  v1::IntegerDirection* const n = claim.contact.mutable_intervals(0)->mutable_integer_direction();
  n->set_x("0");
  n->set_y("-1");
  n->set_z("0");
  ExpectValid(claim, kCeiling, kTurningRod);
  n->set_y("-2");
  ExpectInvalid(claim, kCeiling, kTurningRod, "B does not stay");
}

TEST(MotionCheck, TheLengthOfAQuaternionIsPartOfTheMotion) {
  // q(t) = (1 + t, 0, 0, 2 t) meets the ceiling at a third of the time.
  ExpectInvalid(RodTouches(), kCeiling, Turned(kRod, kNoTurn, {2, 0, 0, 2}), "intervals[0]: B");
  ExpectValid(RodTouches(), kCeiling,
              Turned(kRod, {0x1p-600, 0, 0, 0}, {0x1p-600, 0, 0, 0x1p-600}));
  // A translation keeps a rotation of any length.
  const Moving b = {Cube(), PoseOf(kNoTurn, {3, 0, 0}), PoseOf({7, 0, 0, 0}, {2, 0, 0})};
  ExpectValid(Separated().Until(1, {1, 0, 0}), kCube, b);
}

TEST(MotionCheck, APlaneMustSeparateBetweenTheEnds) {
  // The tip of the rod sweeps from (0, -5, 0) through (5, 0, 0) to (0, 5, 0).
  const Moving rod = Turned(kRod, {1, 0, 0, -1}, {1, 0, 0, 1});
  const Moving wall = Resting(Box({4.5, -1, -1}, {6, 1, 1}));
  ExpectInvalid(Separated().Until(1, {-1, 0, 0}, -4), wall, rod, "B does not stay");
  const Claim claim = Separated().Until(0.25, {-1, 0, 0}, -4.25).Until(0.75, {-1, 0, 0}, -4.25);
  ExpectInvalid(Claim(claim).Until(1, {-1, 0, 0}, -4.25), wall, rod, "intervals[1]: B");
  const Moving farther = Resting(Box({5.5, -1, -1}, {6, 1, 1}));
  ExpectValid(Separated().Until(0.5, {-1, 0, 0}, -5.25).Until(1, {-1, 0, 0}, -5.25), farther, rod);
}

// A point flies ahead of the turning rod, so that no plane of one direction is between them.
TEST(MotionCheck, PlanesMayTurn) {
  const Moving point = Shifted({0, 0, 0}, {5, 5, 0}, {-5, 5, 0});
  const auto claim = [](double offset, double end_offset) {
    return Separated().Until(1, {0, 1, 0}, offset).To({-1, 0, 0}, end_offset);
  };
  // Heights of the tip times 1 + t^2: 5 t (1 - t)^2. Of the point: 5 - 10 t + 10 t^2.
  ExpectValid(claim(1.25, 1.25), kTurningRod, point);
  ExpectInvalid(claim(std::nextafter(1.25, 1.0), 1.25), kTurningRod, point, "A does not stay");
  ExpectValid(claim(1.625, 1.625), kTurningRod, point);
  ExpectValid(claim(1.25, 2), kTurningRod, point);
  ExpectInvalid(claim(1.625, 1.75), kTurningRod, point, "B does not stay");
  ExpectInvalid(Separated().Until(1, {0, 1, 0}, 1.25), kTurningRod, point, "A does not stay");
  // Both are scaled by the same factor.
  ExpectValid(Separated().Until(1, {0, 0x1p-900, 0}, 0x1.4p-900).To({-0x1p-900, 0, 0}, 0x1.4p-900),
              kTurningRod, point);
  // The radii of both count in full.
  const Moving rounded = Rounded(point, 0.25);
  ExpectValid(claim(1.3125, 1.3125), kTurningRod, rounded);
  ExpectInvalid(claim(1.625, 1.625), kTurningRod, rounded, "B does not stay");
  ExpectValid(claim(1.375, 1.375), Rounded(kTurningRod, 0.125), point);
  ExpectInvalid(claim(std::nextafter(1.375, 1.0), 1.375), Rounded(kTurningRod, 0.125), point,
                "A does not stay");
}

TEST(MotionCheck, TheLongerDirectionBoundsARadius) {
  const Moving a = Rounded(Resting({0, 0, 0}), 1);
  const Moving b = Resting({0, 9, 0});
  const auto claim = [](double offset, double end_offset) {
    return Separated().Until(1, {0, 1, 0}, offset).To({0, 2, 0}, end_offset);
  };
  ExpectValid(claim(std::nextafter(2.0, 3.0), std::nextafter(2.0, 3.0)), a, b);
  ExpectInvalid(claim(2, 3), a, b, "A does not stay");
  ExpectInvalid(claim(3, 2), a, b, "A does not stay");
}

TEST(MotionCheck, TheEndOfAPlaneMustBeComplete) {
  const Moving b = Coming(3, 2);
  const auto claim = [] { return Separated().Until(1, {1, 0, 0}, 1.5).To({1, 0, 0}, 1.5); };
  ExpectValid(claim(), kCube, b);
  Claim part = claim();
  part.Last().clear_end_offset();
  ExpectInvalid(part, kCube, b, "the end of a plane needs");
  part = claim();
  part.Last().clear_end_direction();
  ExpectInvalid(part, kCube, b, "the end of a plane needs");
  part = claim();
  part.Last().clear_offset();
  ExpectInvalid(part, kCube, b, "the end of a plane needs");
  ExpectInvalid(claim().To({0, 0, 0}, 1.5), kCube, b, "the direction is zero");
  ExpectInvalid(claim().To({kNaN, 0, 0}, 1.5), kCube, b, "not finite");
  ExpectInvalid(claim().To({1, 0, 0}, kInfinity), kCube, b, "offset is not finite");
}

TEST(MotionCheck, RotationsNeedOffsets) {
  Claim claim = RodTouches();
  claim.contact.mutable_intervals(0)->clear_offset();
  ExpectInvalid(claim, kCeiling, kTurningRod, "intervals[0]: the offset is missing");
  // The rotation vanishes at half time.
  const Moving flipped = Turned(Cube(), kNoTurn, {-1, 0, 0, 0});
  const Moving far_away = Shifted(Cube(), {9, 0, 0}, {9, 0, 0});
  ExpectInvalid(Separated().Until(1, {1, 0, 0}), flipped, far_away, "the offset is missing");
  ExpectInvalid(Separated().Until(1, {1, 0, 0}, 4), flipped, far_away, "A does not stay");
}

TEST(MotionCheck, TranslationsMayUseOffsets) {
  ExpectValid(Separated().Until(1, {1, 0, 0}, 1.25), kCube, Coming(3, 1.5));
  ExpectInvalid(Separated().Until(1, {1, 0, 0}, 1.5), kCube, Coming(3, 1.5), "B does not stay");
  const Moving both[] = {Shifted(Cube(), {-2, 0, 0}, {0, 0, 0}), Coming(3, 1)};
  const Claim meets = Touches().Touching(1, {1, 0, 0}, 4, 0);
  ExpectValid(Claim(meets).Until(1, {1, 0, 0}, 1), both[0], both[1]);
  ExpectInvalid(Separated().Until(1, {1, 0, 0}, 1), both[0], both[1], "A does not stay");
  ExpectInvalid(Claim(meets).Until(0.5, {1, 0, 0}, 2).Until(1, {1, 0, 0}, 1), both[0], both[1],
                "intervals[0]: B does not stay");
}

// |n| = 5, so that the radii keep the planes rational.
TEST(MotionCheck, RadiiAreExactInTranslations) {
  const Moving a = Rounded(Resting({0, 0, 0}), 1);
  // Its center comes from (6, 8, 0) to (3, 4, 0): at a distance of 5 at the end.
  const auto b = [](double radius) {
    return Rounded(Shifted({0, 0, 0}, {6, 8, 0}, {3, 4, 0}), radius);
  };
  const Claim apart = Separated().Until(1, {3, 4, 0});
  ExpectValid(apart, a, b(std::nextafter(4.0, 0.0)));
  ExpectInvalid(apart, a, b(4), "separate at both ends");
  const Claim touches = Touches().Until(1, {3, 4, 0}).Touching(1, {3, 4, 0}, 0, 0);
  ExpectValid(touches, a, b(4));
  ExpectInvalid(touches, a, b(std::nextafter(4.0, 0.0)), "contact: ");
  ExpectInvalid(touches, a, b(std::nextafter(4.0, 5.0)), "separate at both ends");
  // Without a direction, the vertex pair shows an overlap.
  const Claim overlaps = Overlaps().Until(0.5, {3, 4, 0}).Contact(0.75).Pairs({{0, 0}});
  Claim wide = overlaps;
  wide.width = 0.5;
  ExpectValid(wide, a, b(6));
  EXPECT_EQ(Check(overlaps, a, b(6)).code(), absl::StatusCode::kOutOfRange);
  ExpectInvalid(wide, a, b(5), "contact: the hull of the differences");
}

TEST(MotionCheck, RadiiAreExactWithPlanes) {
  const Moving a = Rounded(Resting({0, 0, 0}), 1);
  const Moving b = Rounded(Shifted({0, 0, 0}, {6, 8, 0}, {3, 4, 0}), 2);
  // n.p + |n| = 5 for A, and n.p - 2 |n| >= 15 for B.
  ExpectValid(Separated().Until(1, {3, 4, 0}, std::nextafter(5.0, 6.0)), a, b);
  ExpectValid(Separated().Until(1, {3, 4, 0}, std::nextafter(15.0, 6.0)), a, b);
  ExpectInvalid(Separated().Until(1, {3, 4, 0}, 5), a, b, "A does not stay");
  ExpectInvalid(Separated().Until(1, {3, 4, 0}, 15), a, b, "B does not stay");
  // The length of (1, 1, 0) is irrational.
  const Moving c = Rounded(Shifted({0, 0, 0}, {9, 0, 0}, {3, 0, 0}), 0);
  const double root = std::sqrt(2);
  ExpectValid(Separated().Until(1, {1, 1, 0}, std::nextafter(root, 2.0)), a, c);
  ExpectInvalid(Separated().Until(1, {1, 1, 0}, std::nextafter(root, 1.0)), a, c, "A does not");
}

TEST(MotionCheck, RadiiAreExactInRotations) {
  Claim claim = RodMeets();
  claim.contact.clear_contact_time();
  claim.contact.mutable_intervals()->RemoveLast();
  claim.relation = kSeparated;
  claim.Until(0.4375, {0, -1, 0}, -3.75);
  // The tip of the rod is at y = 3.671 at the end: within a radius of 0.25 of the plane.
  const auto check = [&](double radius) {
    Claim whole = claim;
    whole.relation = kTouching;
    whole.Contact(0.4375);
    return Check(whole, kCeiling, Rounded(kTurningRod, radius));
  };
  EXPECT_THAT(std::string(check(0.0625).message()), HasSubstr("contact: "));
  EXPECT_THAT(std::string(check(0.25).message()), HasSubstr("intervals[1]: B does not stay"));
}

// A piece of length 3 that lies along the rod's outer part, by a quarter turn in its body.
TEST(MotionCheck, ThePoseOfAPieceIsExact) {
  Moving piece = Turned({0, 0, 0, 0, 3, 0}, kNoTurn, {1, 0, 0, 1});
  piece.in_body = PoseOf({3, 0, 0, -3}, {2, 0, 0});
  ExpectValid(RodTouches(), kCeiling, piece);
  piece.in_body = PoseOf({3, 0, 0, -3}, {std::nextafter(2, 3), 0, 0});
  ExpectInvalid(RodTouches(), kCeiling, piece, "contact: ");
  piece.in_body = PoseOf({3, 0, 0, -3}, {2.25, 0, 0});
  ExpectInvalid(RodTouches(), kCeiling, piece, "intervals[1]: B does not stay");
  piece.in_body = PoseOf({3, 0, 0, 3}, {2, 0, 0});
  ExpectInvalid(RodTouches(), kCeiling, piece, "contact: ");
  // A quarter turn about x and 1 along y keep the cube in its place, with other corners.
  const auto coming = [](double z) {
    Moving cube = Coming(5, -3);
    cube.in_body = PoseOf({5, 5, 0, 0}, {0, 1, z});
    return cube;
  };
  const Claim meets = Overlaps().Until(0.5, {1, 0, 0}).Touching(0.5, {1, 0, 0}, 4, 1);
  ExpectValid(meets, kCube, coming(0));
  ExpectInvalid(meets, kCube, coming(0.25), "contact: ");
  const Claim passes = Separated().Until(1, {0, 0, 1});
  ExpectValid(passes, kCube, coming(1.25));
  ExpectInvalid(passes, kCube, coming(0), "does not separate");
}

TEST(MotionCheck, NegativeRadiiAreRefused) {
  ExpectInvalid(Separated().Until(1, {1, 0, 0}), Rounded(kCube, -1), Coming(3, 2), "negative");
}

TEST(MotionCheck, IntervalsMustCoverTheTime) {
  const Moving b = Coming(3, 2);
  const auto claim = [] { return Separated().Until(0.5, {1, 0, 0}).Until(1, {1, 0, 0}); };
  ExpectValid(claim(), kCube, b);
  Claim late = claim();
  late.Last().set_until(0.75);
  ExpectInvalid(late, kCube, b, "the intervals end at 0.75");
  ExpectInvalid(Claim(claim()).Until(1, {1, 0, 0}), kCube, b, "intervals[2] ends at 1");
  for (const double until : {kNaN, -1.0, 0.0, 1.5, kInfinity}) {
    Claim forged = claim();
    forged.contact.mutable_intervals(0)->set_until(until);
    ExpectInvalid(forged, kCube, b, "intervals[0] ends at");
  }
  Claim none = claim();
  none.contact.clear_intervals();
  ExpectInvalid(none, kCube, b, "the intervals end at 0");
}

TEST(MotionCheck, TimesMustFormABracket) {
  const Moving b = Coming(3, -1);
  const auto claim = [] { return Overlaps().Until(0.5, {1, 0, 0}).Touching(0.5, {1, 0, 0}, 4, 0); };
  for (const double until : {kNaN, -0.5, 1.5}) {
    Claim forged = claim();
    forged.contact.set_separated_until(until);
    ExpectInvalid(forged, kCube, b, "separated_until is");
  }
  for (const double time : {kNaN, 0.25, 2.0, kInfinity}) {
    ExpectInvalid(claim().Contact(time), kCube, b, "contact_time is");
  }
  Claim wide = claim();
  wide.Last().set_until(0.25);
  wide.contact.set_separated_until(0.25);
  absl::Status status = Check(wide, kCube, b);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(status.message()), HasSubstr("between 0.25 and 0.5, which are more"));
  wide.width = 0.25;
  ExpectValid(wide, kCube, b);
  Claim without = claim();
  without.contact.clear_contact_time();
  ExpectInvalid(without, kCube, b, "no contact_time");
  ExpectInvalid(Separated().Until(0.5, {1, 0, 0}), kCube, b, "separated_until is not 1");
  ExpectInvalid(Separated().Until(1, {1, 0, 0}).Contact(1), kCube, Coming(3, 2), "contact_time");
}

TEST(MotionCheck, DirectionsAndOffsetsMustBeFiniteAndNonzero) {
  const Moving b = Coming(3, 2);
  ExpectInvalid(Separated().Until(1, {0, 0, 0}), kCube, b, "intervals[0]: the direction is zero");
  ExpectInvalid(Separated().Until(1, {kNaN, 0, 0}), kCube, b, "not finite");
  for (const double offset : {kNaN, kInfinity}) {
    ExpectInvalid(Separated().Until(1, {1, 0, 0}, offset), kCube, b, "offset is not finite");
  }
  Claim none = Separated().Until(1, {1, 0, 0});
  none.Last().clear_direction();
  ExpectInvalid(none, kCube, b, "no direction");
}

TEST(MotionCheck, MalformedMotionsAreRefused) {
  const Claim claim = Separated().Until(1, {1, 0, 0});
  ExpectInvalid(claim, kCube, Coming(3, kNaN),
                "a translation contains a number that is not finite");
  ExpectInvalid(claim, Turned(Cube(), kNoTurn, {0, 0, 0, 0}), Coming(3, 2), "rotation is zero");
}

TEST(MotionCheck, EmptyHullsAreSeparatedThroughout) {
  Claim claim = Separated();
  claim.contact.set_separated_until(1);
  ExpectValid(claim, Resting({}), kCube);
  ExpectInvalid(claim, kCube, Coming(3, 2), "the intervals end at 0");
  ExpectInvalid(Touches().Touching(0, {1, 0, 0}, 4, 0), kCube, Resting({}), "empty");
}

TEST(MotionCheck, OtherRelationsHaveNoProof) {
  ExpectInvalid({v1::RELATION_WITHIN_TOLERANCE}, kCube, Coming(3, 1), "has no certificate");
}

TEST(MotionCheck, TheWholeRangeOfDoublesIsExact) {
  const double huge = std::numeric_limits<double>::max();
  const double least = std::numeric_limits<double>::denorm_min();
  const Moving a = Shifted({0, 0, 0}, {-huge, 0, 0}, {0, 0, 0});
  const Moving b = Shifted({0, 0, 0}, {huge, 0, 0}, {least, 0, 0});
  ExpectValid(Separated().Until(least, {1, 0, 0}).Until(1, {least, 0, 0}), a, b);
  ExpectInvalid(Separated().Until(1, {1, 0, 0}), a, Shifted({0, 0, 0}, {huge, 0, 0}, {0, 0, 0}),
                "separate at both ends");
}

// Random planes and directions: at sampled times in every accepted interval, a separate oracle
// finds the hulls separated.
TEST(MotionCheck, RejectsFalseIntervals) {
  constexpr uint32_t kSeed = 31;
  constexpr int kSamples = 16;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<int> lattice(-2, 2);
  std::uniform_int_distribution<int> size(1, 5);
  constexpr int kScenes = TestSize(8'000, 1'000);
  int accepted = 0;
  int turning = 0;
  for (int scene = 0; scene < kScenes; ++scene) {
    Moving hulls[2];
    Numbers q[2][2];
    Numbers x[2][2];
    for (int k = 0; k < 2; ++k) {
      hulls[k].xyz.resize(3 * static_cast<size_t>(size(random)));
      for (double& number : hulls[k].xyz) number = lattice(random);
      const bool turns = random() % 2 == 0;
      for (int end = 0; end < 2; ++end) {
        q[k][end] = {1 + std::abs(1.0 * lattice(random)), 0, 0, turns ? 1.0 * lattice(random) : 0};
        x[k][end] = {1.0 * lattice(random) + 5 * k, 1.0 * lattice(random), 1.0 * lattice(random)};
      }
      hulls[k].start = PoseOf(q[k][0], x[k][0]);
      hulls[k].end = PoseOf(q[k][1], x[k][1]);
    }
    for (int attempt = 0; attempt < 4; ++attempt) {
      Claim claim = Separated().Until(1, {1, 0.25 * lattice(random), 0});
      const bool has_offset = random() % 4 != 0;
      if (has_offset) claim.Last().set_offset(2.5 + 0.5 * lattice(random));
      if (has_offset && random() % 2 == 0) {
        claim.To({1, 0.25 * lattice(random), 0}, 2.5 + 0.5 * lattice(random));
      }
      if (!Check(claim, hulls[0], hulls[1]).ok()) continue;
      ++accepted;
      turning += static_cast<int>(q[0][0][3] != 0 || q[1][1][3] != 0);
      for (int i = 0; i <= kSamples; ++i) {
        std::vector<oracle::Point> points[2];
        oracle::Placement placements[2];
        for (int k = 0; k < 2; ++k) {
          for (size_t p = 0; p < hulls[k].xyz.size(); p += 3) {
            points[k].push_back({hulls[k].xyz[p], hulls[k].xyz[p + 1], hulls[k].xyz[p + 2]});
          }
          const auto at = [&](const Numbers(&ends)[2], int number) {
            return ((kSamples - i) * ends[0][number] + i * ends[1][number]) / kSamples;
          };
          placements[k] = {{at(q[k], 0), at(q[k], 1), at(q[k], 2), at(q[k], 3)},
                           {at(x[k], 0), at(x[k], 1), at(x[k], 2)}};
        }
        ASSERT_EQ(oracle::BruteForceRelation(points[0], placements[0], points[1], placements[1]),
                  oracle::Relation::kSeparated)
            << "seed " << kSeed << ", scene " << scene << ", time " << i << "/" << kSamples << ": "
            << claim.contact.ShortDebugString();
      }
    }
  }
  EXPECT_GT(accepted, kScenes / 50);
  EXPECT_GT(turning, kScenes / 200);
}

}  // namespace motion_check_test
}  // namespace hulld
