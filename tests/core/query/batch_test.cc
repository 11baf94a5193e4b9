#include "core/query/batch.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <deque>
#include <vector>

#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace batch_test {

// A crowd of hulls of all dimensions, some of them in exact contact.
struct Crowd {
  std::deque<Hull> hulls;
  std::deque<QueryHull> query_hulls;
  std::vector<PlacedHull> placements;
  std::vector<PlacedPair> pairs;
};

Crowd MakeCrowd(uint64_t seed) {
  Random random(seed);
  Crowd crowd;
  crowd.hulls.emplace_back();  // an empty one
  for (int i = 0; i < 12; ++i) {
    crowd.hulls.push_back(BuildHull(RandomLatticePoints(random, random.Between(1, 12), 3)));
    crowd.hulls.push_back(BuildHull(RandomInBall(random, 40, 2)));
  }
  for (const Hull& hull : crowd.hulls) crowd.query_hulls.emplace_back(hull);
  for (int i = 0; i < 40; ++i) {
    Pose pose;
    // Mostly on a lattice, where hulls touch.
    if (i % 4 == 0) pose.q = {2, 1, 0, 0};
    if (i % 4 == 1) pose.q = {1, 1, 0, 0};
    pose.t = Vector(random.Between(-1, 1), random.Between(-1, 1), random.Between(-1, 1)) * 2;
    const int hull = random.Below(static_cast<int>(crowd.hulls.size()));
    crowd.placements.push_back(
        *PlacedHull::Make(crowd.query_hulls[static_cast<size_t>(hull)], pose));
  }
  for (uint32_t a = 0; a < 40; ++a) {
    for (uint32_t b = 0; b < 40; ++b) crowd.pairs.push_back({a, b});
  }
  return crowd;
}

void ExpectSameAnswer(const Answer& actual, const Answer& expected) {
  EXPECT_EQ(actual.relation, expected.relation);
  EXPECT_EQ(actual.rung, expected.rung);
  EXPECT_EQ(actual.analysis->axes_tested, expected.analysis->axes_tested);
  EXPECT_EQ(actual.analysis->axes_total, expected.analysis->axes_total);
  EXPECT_EQ(actual.analysis->stage, expected.analysis->stage);
  EXPECT_EQ(actual.analysis->axis_index, expected.analysis->axis_index);
  ASSERT_EQ(actual.axis.has_value(), expected.axis.has_value());
  if (!expected.axis) return;
  EXPECT_EQ(actual.axis->direction, expected.axis->direction);
  EXPECT_EQ(actual.axis->kind, expected.axis->kind);
  EXPECT_EQ(actual.axis->feature_a.vertices, expected.axis->feature_a.vertices);
  EXPECT_EQ(actual.axis->feature_b.vertices, expected.axis->feature_b.vertices);
}

TEST(Batch, EqualsOneByOneOnAnyNumberOfThreads) {
  const Crowd crowd = MakeCrowd(701);
  std::array<int, 3> seen = {};
  for (Method method : {Method::kCertifiedSearch, Method::kTextbookSat}) {
    QueryOptions options;
    options.method = method;
    options.want_axis = true;
    options.want_analysis = true;
    // The textbook method on all pairs would be slow; every seventh pair suffices.
    std::vector<PlacedPair> pairs;
    for (size_t i = 0; i < crowd.pairs.size(); i += method == Method::kTextbookSat ? 7 : 1) {
      pairs.push_back(crowd.pairs[i]);
    }
    std::vector<Answer> expected;
    for (const PlacedPair& pair : pairs) {
      const PlacedHull& a = crowd.placements[pair.a];
      const PlacedHull& b = crowd.placements[pair.b];
      expected.push_back(CheckCollision(a, b, options).value());
      ++seen[static_cast<size_t>(expected.back().relation)];
    }
    for (int threads : {1, 2, 8}) {
      const auto answers = CheckCollisions(crowd.placements, pairs, options, threads);
      ASSERT_EQ(answers.size(), pairs.size());
      for (size_t i = 0; i < pairs.size(); ++i) {
        SCOPED_TRACE(testing::Message() << "pair " << pairs[i].a << ", " << pairs[i].b << " on "
                                        << threads << " threads");
        ASSERT_TRUE(answers[i].ok()) << answers[i].status();
        ExpectSameAnswer(*answers[i], expected[i]);
        ASSERT_FALSE(HasFailure());
      }
    }
  }
  for (int count : seen) EXPECT_GT(count, 20);
}

TEST(Batch, RelationsAloneEqualThoseOfFullAnswers) {
  const Crowd crowd = MakeCrowd(704);
  QueryOptions whole;
  whole.want_axis = true;
  whole.want_certificate = true;
  const auto expected = CheckCollisions(crowd.placements, crowd.pairs, whole, 1);
  std::array<int, 3> seen = {};
  for (int threads : {1, 2, 8}) {
    const auto answers = CheckCollisions(crowd.placements, crowd.pairs, {}, threads);
    ASSERT_EQ(answers.size(), crowd.pairs.size());
    for (size_t i = 0; i < crowd.pairs.size(); ++i) {
      ASSERT_EQ(answers[i]->relation, expected[i]->relation) << "pair " << i;
      EXPECT_FALSE(answers[i]->axis || answers[i]->certificate || answers[i]->analysis);
      ++seen[static_cast<size_t>(answers[i]->relation)];
    }
  }
  for (const int count : seen) EXPECT_GT(count, 60);
}

TEST(Batch, AnswersWithAToleranceDoNotDependOnThreads) {
  const Crowd crowd = MakeCrowd(704);
  QueryOptions options;
  options.tolerance = 0.5;
  const auto expected = CheckCollisions(crowd.placements, crowd.pairs, options, 1);
  std::array<int, 4> seen = {};
  for (int threads : {2, 8}) {
    const auto answers = CheckCollisions(crowd.placements, crowd.pairs, options, threads);
    for (size_t i = 0; i < crowd.pairs.size(); ++i) {
      ASSERT_EQ(answers[i]->relation, expected[i]->relation) << "pair " << i;
      ASSERT_EQ(answers[i]->rung, expected[i]->rung) << "pair " << i;
      ++seen[static_cast<size_t>(answers[i]->relation)];
    }
  }
  EXPECT_GT(seen[static_cast<size_t>(Relation::kWithinTolerance)], 60);
}

TEST(Batch, PollsLessOftenThanItAnswersAndStaysStopped) {
  const Crowd crowd = MakeCrowd(705);
  for (int threads : {1, 4}) {
    std::atomic<int> polls = 0;
    QueryOptions options;
    options.should_stop = [&] { return ++polls > 10; };
    const auto answers = CheckCollisions(crowd.placements, crowd.pairs, options, threads);
    EXPECT_EQ(answers.back().status().code(), absl::StatusCode::kCancelled);
    // Polled repeatedly, but not for every trivial pair.
    EXPECT_LT(polls, 1000);
  }
}

TEST(Batch, NoPairsYieldNoAnswers) {
  const Crowd crowd = MakeCrowd(702);
  EXPECT_TRUE(CheckCollisions(crowd.placements, {}, {}, 4).empty());
  EXPECT_TRUE(CheckCollisions({}, {}, {}, 1).empty());
}

TEST(Batch, CancellationCancelsOnlyTheRemainingPairs) {
  const Crowd crowd = MakeCrowd(703);
  for (int threads : {1, 4}) {
    std::atomic<int> polls = 0;
    QueryOptions options;
    options.should_stop = [&] { return ++polls > 100; };
    const auto answers = CheckCollisions(crowd.placements, crowd.pairs, options, threads);
    ASSERT_EQ(answers.size(), crowd.pairs.size());
    size_t cancelled = 0;
    for (size_t i = 0; i < answers.size(); ++i) {
      if (!answers[i].ok()) {
        EXPECT_EQ(answers[i].status().code(), absl::StatusCode::kCancelled);
        ++cancelled;
        continue;
      }
      const PlacedHull& a = crowd.placements[crowd.pairs[i].a];
      const PlacedHull& b = crowd.placements[crowd.pairs[i].b];
      EXPECT_EQ(answers[i]->relation, CheckCollision(a, b)->relation);
    }
    EXPECT_GT(cancelled, 0u);
  }
}

TEST(Batch, OnlyThePairTooLargeForTheTextbookFails) {
  const Hull cube = BuildHull(LatticeCube(2, 1));
  const Hull ball = BuildHull(FibonacciSphere(60));
  const QueryHull query_cube(cube);
  const QueryHull query_ball(ball);
  const std::vector<PlacedHull> placements = {*PlacedHull::Make(query_cube, {}),
                                              *PlacedHull::Make(query_ball, {})};
  const std::vector<PlacedPair> pairs = {{0, 0}, {1, 1}, {0, 0}};
  QueryOptions options;
  options.method = Method::kTextbookSat;
  options.max_textbook_axes = 1000;
  const auto answers = CheckCollisions(placements, pairs, options, 2);
  EXPECT_TRUE(answers[0].ok());
  EXPECT_EQ(answers[1].status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(answers[2].ok());
}

}  // namespace batch_test
}  // namespace hulld
