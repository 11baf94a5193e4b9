#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/query/motion/first_contact.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/motion/motion_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace graze_test {

using oracle::Rational;

std::vector<Vector> Box(double x, double y, double z) {
  std::vector<Vector> corners;
  for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z});
  return corners;
}

std::vector<Vector> Octahedron() {
  return {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
}

// Returns a turn about an axis from -45 to 45 degrees. At time 1/2, the rotation is the identity.
Motion Swinging(const Vector& axis) {
  const double c = std::cos(M_PI / 8);
  const Vector v = std::sin(M_PI / 8) * axis;
  return {{{c, -v.x(), -v.y(), -v.z()}, Vector::Zero()},
          {{c, v.x(), v.y(), v.z()}, Vector::Zero()}};
}

// A hull in motion, with a size of about 1.
struct Part {
  std::vector<Vector> points;
  Motion motion = {};
  double radius = 0;
  Pose X_BH = {};
};

// A swings past B with a minimum separation of zero, reached at time 1/2 along x.
struct Passage {
  std::string name;
  Part a;
  Part b;
};

std::vector<Passage> Passages() {
  const std::vector<Vector> wall = Shifted(Box(0.5, 2, 2), {1.5, 0, 0});
  const std::vector<Vector> ridge = {{1, 0, -0.5},   {1, 0, 0.5},    {0, -0.5, -0.5},
                                     {0, -0.5, 0.5}, {0, 0.5, -0.5}, {0, 0.5, 0.5}};
  const std::vector<Vector> across = {{1, -1, 0}, {1, 1, 0},  {2, -1, -1},
                                      {2, 1, -1}, {2, -1, 1}, {2, 1, 1}};
  const std::vector<Vector> far_tip = Shifted(Octahedron(), {2, 0, 0});
  const Vector z(0, 0, 1);
  // A tip rolls over a face, as the teeth of gears do, so that the nearest direction turns.
  Motion rolling = Swinging(-z);
  rolling.start.t = rolling.end.t = {2, 0, 0};
  const Vector tilted(0.6, 0, 0.8);
  const Pose shifted = {{1, 1, 0, 0}, {0.25, 0, 0}};
  const std::vector<Vector> back = Shifted(Octahedron(), {-0.25, 0, 0});
  return {
      {"vertex and face", {Octahedron(), Swinging(z)}, {wall}},
      {"vertex and turning face", {Octahedron(), Swinging(tilted)}, {wall, Swinging({1, 0, 0})}},
      {"vertex and rolling face", {Box(1, 0.5, 0.5), Swinging(z)}, {Octahedron(), rolling}},
      {"ball and rolling face",
       {Box(1, 0.5, 0.5), Swinging(z)},
       {Scaled(Octahedron(), 0.75), rolling, 0.25}},
      {"edge and face", {ridge, Swinging(z)}, {wall}},
      {"edge and edge", {ridge, Swinging(tilted)}, {across}},
      {"vertex and edge", {Octahedron(), Swinging(tilted)}, {across}},
      {"vertex and vertex", {Octahedron(), Swinging(z)}, {far_tip}},
      {"vertices, both turning", {Octahedron(), Swinging(tilted)}, {far_tip, Swinging({1, 0, 0})}},
      {"faces", {Box(1, 0.5, 0.5), Swinging({1, 0, 0})}, {wall}},
      {"balls", {Octahedron(), Swinging(z), 0.25}, {Shifted(far_tip, {0.25, 0, 0})}},
      {"ball and edge",
       {ridge, Swinging(tilted), 0.125},
       {Shifted(across, {0.25, 0, 0}), {}, 0.125}},
      {"piece and face", {back, Swinging(z), 0, shifted}, {wall}},
      {"piece and edge", {back, Swinging(tilted), 0, shifted}, {across}},
      {"piece and vertex",
       {back, Swinging(tilted), 0.25, shifted},
       {Shifted(far_tip, {0.25, 0, 0})}},
  };
}

OwnMoving Moving(const Part& part, double scale, double shift) {
  Part scaled = part;
  scaled.X_BH.t *= scale;
  for (Pose* pose : {&scaled.motion.start, &scaled.motion.end}) {
    pose->t = scale * (pose->t + shift * Vector::UnitX());
  }
  return OwnMoving(Scaled(part.points, scale), scaled.motion, scale * part.radius, scaled.X_BH);
}

struct Answered {
  FirstContact contact;
  // Number of times that the search polled should_stop: at least once per step.
  int polls = 0;
};

Answered Find(const OwnMoving& a, const OwnMoving& b, MotionOptions options = {}) {
  Answered answered;
  options.want_certificate = true;
  options.should_stop = [&] {
    ++answered.polls;
    return false;
  };
  absl::StatusOr<FirstContact> contact = FindFirstContact(a.moving(), b.moving(), options);
  EXPECT_TRUE(contact.ok()) << contact.status();
  if (!contact.ok()) return answered;
  EXPECT_TRUE(ContactIsProven(a, b, *contact));
  answered.contact = *std::move(contact);
  return answered;
}

MotionOptions FinestResolution() {
  MotionOptions options;
  options.resolution = 0;
  return options;
}

constexpr double kAllScales[] = {1, 3e-18};
constexpr auto kScales = std::span(kAllScales).first(TestSize(2, 1));
constexpr int kDigitStep = TestSize(2, 8);
// Exact arithmetic polls several times per step. Observed: 282.
constexpr int kMaxPolls = 400;

TEST(Graze, StepsGrowWithTheLogarithmOfTheGap) {
  for (const Passage& passage : Passages()) {
    for (const double scale : kScales) {
      for (int digits = 6; digits <= 14; digits += kDigitStep) {
        SCOPED_TRACE(testing::Message() << passage.name << " at " << scale << ", 1e-" << digits);
        const OwnMoving a = Moving(passage.a, scale, 0);
        const OwnMoving b = Moving(passage.b, scale, std::pow(10, -digits));
        const Answered exact = Find(a, b, FinestResolution());
        EXPECT_FALSE(exact.contact.contact_time.has_value());
        if (digits <= 10) {
          EXPECT_EQ(exact.contact.relation, Relation::kSeparated);
        }
        EXPECT_LE(exact.contact.intervals.size(), static_cast<size_t>(10 + 4 * digits));
        EXPECT_LE(exact.polls, 40 + 20 * digits);
        const Answered coarse = Find(a, b);
        EXPECT_FALSE(coarse.contact.contact_time.has_value());
        EXPECT_LE(coarse.polls, 40 + 20 * digits);
      }
    }
  }
}

TEST(Graze, ShallowContactsAreFound) {
  for (const Passage& passage : Passages()) {
    for (const double scale : kScales) {
      for (int digits = 6; digits <= 14; digits += kDigitStep) {
        SCOPED_TRACE(testing::Message() << passage.name << " at " << scale << ", -1e-" << digits);
        const OwnMoving a = Moving(passage.a, scale, 0);
        const OwnMoving b = Moving(passage.b, scale, -std::pow(10, -digits));
        const Answered exact = Find(a, b, FinestResolution());
        EXPECT_NE(exact.contact.relation, Relation::kSeparated);
        if (digits <= 8) {
          EXPECT_EQ(exact.contact.relation, Relation::kOverlapping);
        }
        EXPECT_LE(exact.polls, kMaxPolls);
      }
    }
  }
}

// The separation is smallest at time 1/2, and positive there if and only if the gap is positive.
TEST(Graze, AnswersAgreeWithDenseSamples) {
  std::vector<Rational> times = {Rational(1, 2)};
  for (int i = 0; i <= 16; i += TestSize(1, 4)) times.push_back(Rational(i, 16));
  for (int exponent = 4; exponent <= 44; exponent += TestSize(8, 20)) {
    const Rational step(std::ldexp(1, -exponent));
    times.push_back(Rational(1, 2) - step);
    times.push_back(Rational(1, 2) + step);
  }
  for (const Passage& passage : Passages()) {
    if (passage.a.radius > 0 || passage.b.radius > 0) continue;
    for (const double gap : {1e-7, 1e-10, 1e-13, -1e-13, -1e-10}) {
      SCOPED_TRACE(testing::Message() << passage.name << ", " << gap);
      const OwnMoving a = Moving(passage.a, 1, 0);
      const OwnMoving b = Moving(passage.b, 1, gap);
      const FirstContact contact = Find(a, b).contact;
      bool meets = false;
      for (const Rational& t : times) {
        if (oracle::RelationAt(a.ForOracle(), b.ForOracle(), t) == oracle::Relation::kSeparated) {
          continue;
        }
        meets = true;
        EXPECT_NE(contact.relation, Relation::kSeparated) << t;
        EXPECT_TRUE(t > Rational(contact.separated_until) || contact.contact_time == 0) << t;
      }
      EXPECT_EQ(meets, gap < 0);
      EXPECT_TRUE(meets || !contact.contact_time.has_value());
    }
  }
}

// A tip passes the wall, however close, and a longer tip meets it after another quarter turn.
TEST(Graze, ContactAfterAGrazeIsFound) {
  std::vector<Vector> tips = Octahedron();
  tips[3] = {0, -1.01, 0};
  const Motion turn = {{{std::cos(M_PI / 8), 0, 0, -std::sin(M_PI / 8)}, Vector::Zero()},
                       {{std::cos(M_PI / 3), 0, 0, std::sin(M_PI / 3)}, Vector::Zero()}};
  for (const double gap : {1e-7, 1e-11, 1e-13, 1e-15}) {
    SCOPED_TRACE(gap);
    const Answered met =
        Find(Moving({tips, turn}, 1, 0), Moving({Shifted(Box(0.5, 2, 2), {1.5, 0, 0})}, 1, gap));
    EXPECT_EQ(met.contact.relation, Relation::kOverlapping);
    EXPECT_LE(met.polls, kMaxPolls);
  }
}

}  // namespace graze_test
}  // namespace hulld
