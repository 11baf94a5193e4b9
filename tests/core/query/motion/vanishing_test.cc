#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/query/motion/first_contact.h"
#include "core/query/motion/pair_at.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/motion/motion_check.h"
#include "tests/test_size.h"

// Rotations whose q(t) misses zero by a unit in the last place or more. The rotation then makes a
// full turn within about that share of the motion.
namespace hulld {
namespace vanishing_test {

using oracle::Rational;

// Maximum number of polls in a search that terminates. Observed with eleven seeds: 634.
constexpr int kMaxPolls = 1000;

using Quaternion = std::array<double, 4>;

Quaternion RandomQuaternion(Random& random, double length) {
  Quaternion q;
  for (double& component : q) component = length * random.Real(-1, 1);
  return q;
}

// Returns -factor q with an error of `miss` times its length in one component, and at least a unit
// in the last place.
Quaternion NearlyOpposite(Random& random, const Quaternion& q, double factor, double miss) {
  Quaternion opposite;
  double largest = 0;
  for (int i = 0; i < 4; ++i) {
    opposite[i] = -factor * q[i];
    largest = std::max(largest, std::abs(opposite[i]));
  }
  double& component = opposite[random.Below(4)];
  const double moved = component + miss * largest;
  component = moved != component ? moved : std::nextafter(component, 2 * largest);
  return opposite;
}

// Returns the time at which |q(t)| is smallest, rounded down.
double LeastTime(const Motion& motion) {
  Rational of_start = 0;
  Rational squared = 0;
  for (int i = 0; i < 4; ++i) {
    const Rational step = Rational(motion.end.q[i]) - Rational(motion.start.q[i]);
    of_start -= step * Rational(motion.start.q[i]);
    squared += step * step;
  }
  return static_cast<double>(Rational(of_start / squared));
}

// Returns times at which the oracle tests for contact: evenly spaced, and densely around a given
// time.
std::vector<Rational> TimesAround(double middle) {
  std::vector<Rational> times;
  for (int i = 0; i <= 8; ++i) times.push_back(Rational(i, 8));
  for (int exponent = 8; exponent <= 64; exponent += 8) {
    const Rational step(std::ldexp(1, -exponent));
    for (const Rational& time : {Rational(middle) - step, Rational(middle) + step}) {
      if (Rational(0) < time && time < Rational(1)) times.push_back(time);
    }
  }
  std::sort(times.begin(), times.end());
  return times;
}

// Returns the first of the times at which the hulls meet.
std::optional<Rational> FirstSampledContact(const OwnMoving& a, const OwnMoving& b,
                                            const std::vector<Rational>& times) {
  for (const Rational& time : times) {
    if (oracle::RelationAt(a.ForOracle(), b.ForOracle(), time) != oracle::Relation::kSeparated) {
      return time;
    }
  }
  return std::nullopt;
}

// Finds the first contact with a certificate; fails if the search polls too often.
absl::StatusOr<FirstContact> Find(const OwnMoving& a, const OwnMoving& b, MotionOptions options) {
  int polls = 0;
  options.want_certificate = true;
  options.should_stop = [&] {
    ++polls;
    return false;
  };
  absl::StatusOr<FirstContact> contact = FindFirstContact(a.moving(), b.moving(), options);
  EXPECT_LE(polls, kMaxPolls);
  return contact;
}

// Succeeds if the answer is proven and no sample contradicts it.
testing::AssertionResult IsRight(const OwnMoving& a, const OwnMoving& b,
                                 const MotionOptions& options, const FirstContact& contact,
                                 const std::optional<Rational>& sampled) {
  if (testing::AssertionResult proven = ContactIsProven(a, b, contact); !proven) return proven;
  const Rational until(contact.separated_until);
  if (sampled && *sampled < until) return testing::AssertionFailure() << "contact at " << *sampled;
  if (contact.relation == Relation::kSeparated) {
    return sampled ? testing::AssertionFailure() << "contact at " << *sampled
                   : testing::AssertionSuccess();
  }
  const bool is_narrow =
      contact.contact_time &&
      (Rational(*contact.contact_time) - until <= Rational(options.max_time_error) ||
       std::nextafter(contact.separated_until, 2.0) == *contact.contact_time);
  if (is_narrow) return testing::AssertionSuccess();
  const MovingHull moving_a = a.moving();
  const MovingHull moving_b = b.moving();
  const double sizes = moving_a.hull.max_abs_coordinate() + moving_b.hull.max_abs_coordinate();
  double translations = 0;
  for (const Motion& motion : {moving_a.X_WB, moving_b.X_WB}) {
    translations +=
        std::max(motion.start.t.cwiseAbs().maxCoeff(), motion.end.t.cwiseAbs().maxCoeff());
  }
  double resolution = 2 * kMinRelativeResolution * (sizes + translations);
  if (!contact.contact_time) {
    resolution =
        std::max(resolution, options.resolution.value_or(kDefaultRelativeResolution * sizes));
  }
  const absl::StatusOr<bool> near =
      PairAt(moving_a, moving_b, contact.separated_until).IsWithin(resolution, {});
  return near.ok() && *near ? testing::AssertionSuccess()
                            : testing::AssertionFailure() << "undecided, although far apart";
}

bool IsRefusal(const absl::Status& status) {
  return absl::IsInvalidArgument(status) &&
         status.message().find("nearly vanishes") != std::string::npos;
}

struct Counts {
  int refused = 0;
  int separated = 0;
  int met_before = 0;
  int met_there_or_after = 0;
};

// Queries a pair in which the rotation of A nearly vanishes.
void CheckContact(const OwnMoving& a, const OwnMoving& b, const Motion& X_WA,
                  const MotionOptions& options, double miss, Counts& counts) {
  const double least = LeastTime(X_WA);
  const std::optional<Rational> sampled = FirstSampledContact(a, b, TimesAround(least));
  const absl::StatusOr<FirstContact> contact = Find(a, b, options);
  if (!contact.ok()) {
    EXPECT_TRUE(IsRefusal(contact.status())) << contact.status();
    ++counts.refused;
    // The contract: q(t) falls below 2^-38 of its size at the ends, and the pair does not meet
    // before that.
    EXPECT_LT(miss, 0x1p-34);
    if (sampled) {
      EXPECT_GE(*sampled, Rational(least) - Rational(0x1p-34)) << *sampled;
    }
    return;
  }
  EXPECT_TRUE(IsRight(a, b, options, *contact, sampled));
  if (contact->relation == Relation::kSeparated) ++counts.separated;
  if (!contact->contact_time) return;
  ++(*contact->contact_time < least ? counts.met_before : counts.met_there_or_after);
}

constexpr int kRounds = TestSize(70, 6);

TEST(Vanishing, MotionsAreAnsweredOrRefusedAsTheContractSays) {
  Random random(TestSeed(1));
  Counts counts;
  constexpr double kMisses[] = {0, 0x1p-50, 0x1p-44, 0x1p-40, 0x1p-32, 0x1p-28, 0x1p-20};
  constexpr double kLengths[] = {1, 1e-160, 1e160, 0x1p-1060, 0x1p1000};
  constexpr double kScales[] = {1, 1e-150, 1e60, 0x1p-500, 0x1p500};
  for (int round = 0; round < kRounds; ++round) {
    SCOPED_TRACE(round);
    const double miss = kMisses[round % 7];
    const double length = kLengths[random.Below(5)];
    const double scale = kScales[random.Below(5)];
    // The rotation vanishes near one of the times 1/2, 3/4, 1/8, or 2/3.
    const double factor = std::array{1.0, 1.0 / 3, 7.0, 0.5}[random.Below(4)];
    Motion X_WA;
    X_WA.start.q = RandomQuaternion(random, length / 8);
    X_WA.end.q = NearlyOpposite(random, X_WA.start.q, factor, miss);
    for (Pose* pose : {&X_WA.start, &X_WA.end}) {
      for (int i = 0; i < 3; ++i) pose->t[i] = scale * random.Real(-1.5, 1.5);
    }
    const Pose X_WB = {RandomQuaternion(random, 1),
                       scale * Vector(random.Real(-2, 2), random.Real(-2, 2), random.Real(-2, 2))};
    // Half of the motions go through B.
    if (round % 2 == 0) X_WA.end.t = 2 * X_WB.t - X_WA.start.t;
    if (!ValidateMotion(X_WA).ok()) continue;
    MotionOptions options;
    options.max_time_error = std::array{1.0, 0x1p-10, 0x1p-30, 0x1p-45}[random.Below(4)];
    if (round % 3 == 0) options.resolution = scale * std::array{0.0, 1e-3, 0.5}[random.Below(3)];
    const OwnMoving a(Scaled(RandomInBall(random, random.Between(4, 6), 1), scale), X_WA, 0,
                      round % 5 == 4 ? Pose{{1, 2, 0, 1}, scale * Vector(0.5, 0, 0)} : Pose());
    const OwnMoving b(Scaled(RandomInBall(random, random.Between(1, 6), 1), scale), {X_WB, X_WB});
    CheckContact(a, b, X_WA, options, std::max(miss, length < 0x1p-1000 ? 0x1p-20 : 0), counts);
  }
#ifndef HULLD_SANITIZED
  EXPECT_GT(counts.refused, 10);
  EXPECT_GT(counts.separated, 5);
  EXPECT_GT(counts.met_before, 5);
  EXPECT_GT(counts.met_there_or_after, 0);
#endif
}

// A rod turns once about its middle, near time 1/2, and sweeps a disc.
TEST(Vanishing, ASweepBetweenTwoTimesIsNeverMissed) {
  const std::vector<Vector> rod = {
      {2, 0, 0}, {-2, 0, 0}, {0, 0.25, 0}, {0, 0, 0.25}, {0, 0, -0.25}};
  const std::vector<Vector> post = {{0.5, 1, -1}, {-0.5, 1, -1}, {0, 1.5, -1}, {0, 1.25, 1}};
  for (const double miss : {0x1p-53, 0x1p-48, 0x1p-42, 0x1p-38, 0x1p-34, 0x1p-26, 0x1p-16}) {
    for (const double scale : {1.0, 1e-150, 1e150}) {
      SCOPED_TRACE(testing::Message() << miss << " at " << scale);
      const Motion flip = {{{1, 0, 0, 0}, Vector::Zero()}, {{-1, 0, 0, miss}, Vector::Zero()}};
      const OwnMoving a(Scaled(rod, scale), flip);
      const OwnMoving b(Scaled(post, scale), Motion());
      Counts counts;
      CheckContact(a, b, flip, {}, miss, counts);
      EXPECT_EQ(counts.separated, 0);
      if (miss > 0x1p-36) {
        EXPECT_EQ(counts.met_before + counts.met_there_or_after, 1);
      }
    }
  }
}

// The pair is within the resolution when the rotation vanishes, and in contact much later: no
// bracket as narrow as requested can be proven.
TEST(Vanishing, NoBracketSpansTheTimeAtWhichARotationVanishes) {
  const std::vector<Vector> cube = {{-1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {-1, 1, 1},
                                    {1, -1, -1},  {1, -1, 1},  {1, 1, -1},  {1, 1, 1}};
  MotionOptions options;
  options.resolution = 0.5;
  const auto entering = [](double miss) {
    return Motion{{{1, 0, 0, 0}, {2.4375, 0, 0}}, {{-1, miss, 0, 0}, {1.9375, 0, 0}}};
  };
  const OwnMoving at_rest(cube, Motion());
  const OwnMoving vanishing(cube, entering(0x1p-53));
  const absl::StatusOr<FirstContact> refused = Find(at_rest, vanishing, options);
  EXPECT_TRUE(IsRefusal(refused.status())) << refused.status();
  const OwnMoving turning(cube, entering(0x1p-30));
  const absl::StatusOr<FirstContact> contact = Find(at_rest, turning, options);
  ASSERT_TRUE(contact.ok());
  EXPECT_TRUE(IsRight(at_rest, turning, options, *contact, std::nullopt));
  // A contact before that time is found.
  const Motion earlier = {{{1, 0, 0, 0}, {2.25, 0, 0}}, {{-1, 0x1p-53, 0, 0}, {1.25, 0, 0}}};
  const OwnMoving meeting(cube, earlier);
  const absl::StatusOr<FirstContact> met = Find(at_rest, meeting, options);
  ASSERT_TRUE(met.ok());
  EXPECT_NEAR(met->contact_time.value(), 0.25, 0x1p-29);
  EXPECT_TRUE(IsRight(at_rest, meeting, options, *met, std::nullopt));
}

// If the shapes are outside the size range of planes, a radius or a rotation is refused, too.
TEST(Vanishing, NoBracketSpansTimesWithoutPlanes) {
  for (const double scale : {0x1p-800, 0x1p920}) {
    const std::vector<Vector> points = {{0, 0, 0}, {scale, 0, 0}, {0, scale, 0}, {0, 0, scale}};
    const Motion entering = {{{1, 0, 0, 0}, scale * Vector(1.25, 0, 0)},
                             {{1, 0, 0, 0.5}, scale * Vector(0.25, 0, 0)}};
    MotionOptions options;
    options.resolution = 0.5 * scale;
    const absl::StatusOr<FirstContact> contact =
        Find(OwnMoving(points, Motion()), OwnMoving(points, entering), options);
    EXPECT_TRUE(absl::IsInvalidArgument(contact.status())) << contact.status();
  }
}

}  // namespace vanishing_test
}  // namespace hulld
