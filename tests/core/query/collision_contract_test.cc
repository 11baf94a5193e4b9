#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/batch.h"
#include "core/query/body/placed_body.h"
#include "core/query/collision.h"
#include "core/query/floating/float_search.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/relation_check.h"

namespace hulld {
namespace collision_contract_test {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Hull UnitCube() { return BuildHull(LatticeCube(2, 1)); }

Pose At(double x, double y, double z) {
  Pose pose;
  pose.t = Vector(x, y, z);
  return pose;
}

QueryOptions Options(Method method) {
  QueryOptions options;
  options.method = method;
  options.want_axis = true;
  options.want_analysis = true;
  return options;
}

// A hull that is prepared or placed must outlive the result, so it cannot be a temporary.
static_assert(!std::is_constructible_v<QueryHull, Hull>);
static_assert(!std::is_constructible_v<PlacedHull, QueryHull, Pose>);
static_assert(!std::is_constructible_v<QueryBody, QueryHull>);
static_assert(!std::is_constructible_v<PlacedBody, QueryBody, Pose>);
static_assert(std::is_constructible_v<QueryHull, Hull&>);
static_assert(std::is_constructible_v<PlacedHull, const QueryHull&, Pose>);

TEST(Collision, AnEmptyHullIsSeparatedFromAll) {
  const Hull empty;
  const std::vector<Vector> origin = {{0, 0, 0}};
  RelationCheck check;
  EXPECT_TRUE(check.Verify(empty, Pose(), empty, Pose(), Relation::kSeparated));
  EXPECT_TRUE(check.Verify(empty, Pose(), UnitCube(), Pose(), Relation::kSeparated));
  EXPECT_TRUE(check.Verify(empty, Pose(), BuildHull(origin), At(1, 2, 3), Relation::kSeparated));
}

// Regression test: formerly, a single call returned EXACT and a stream BOUNDS.
TEST(Collision, AnEmptyHullIsDecidedByTheSameRungInEveryCall) {
  const Hull empty;
  const Hull cube = UnitCube();
  const QueryHull query_empty(empty);
  const QueryHull query_cube(cube);
  const std::vector<PlacedHull> placements = {*PlacedHull::Make(query_empty, Pose()),
                                              *PlacedHull::Make(query_cube, Pose())};
  PairCache cache;
  QueryOptions everything;
  everything.want_axis = true;
  everything.want_analysis = true;
  everything.want_certificate = true;
  everything.want_separation = true;
  everything.want_witness = true;
  everything.clearance = 1;
  for (const PlacedPair& pair : {PlacedPair{0, 1}, PlacedPair{1, 0}, PlacedPair{0, 0}}) {
    const PlacedHull& a = placements[pair.a];
    const PlacedHull& b = placements[pair.b];
    EXPECT_EQ(CheckCollision(a, b)->rung, Rung::kBounds);
    EXPECT_EQ(CheckCollision(a, b, {}, &cache)->rung, Rung::kBounds);
    EXPECT_EQ(CheckCollision(a, b, everything)->rung, Rung::kBounds);
    EXPECT_EQ(CheckCollision(a, b, Options(Method::kTextbookSat))->rung, Rung::kBounds);
    EXPECT_EQ(CheckCollisions(placements, {&pair, 1}, {}, 1)[0]->rung, Rung::kBounds);
    EXPECT_EQ(CheckCollision(a, b)->relation, Relation::kSeparated);
  }
}

// Stacked boxes at rest.
TEST(Collision, HullsThatTouchedAreAnsweredFromTheCacheAtTheSameRelativePose) {
  const Hull cube = UnitCube();
  const QueryHull query_cube(cube);
  const auto ask = [&](const Pose& X_WA, const Pose& X_WB, PairCache* cache, double tolerance = 0) {
    QueryOptions options;
    options.tolerance = tolerance;
    const Answer answer =
        CheckCollision(PlacedHull(query_cube, X_WA), PlacedHull(query_cube, X_WB), options, cache)
            .value();
    return std::pair(answer.relation, answer.rung);
  };
  const std::pair from_cache(Relation::kTouching, Rung::kCached);
  const std::pair exactly(Relation::kTouching, Rung::kExact);
  // In both orders of content.
  for (const double side : {1.0, -1.0}) {
    PairCache cache;
    const Pose X_WA = At(0.5, 0, 0);
    const Pose X_WB = At(0.5 + side, 0.25, 0);
    EXPECT_EQ(ask(X_WA, X_WB, &cache), exactly);
    EXPECT_EQ(ask(X_WA, X_WB, &cache), from_cache);
    // A conveyor moves both, as far as doubles allow without rounding.
    EXPECT_EQ(ask(At(7.5, 0, 3), At(7.5 + side, 0.25, 3), &cache), from_cache);
    // t_B - t_A rounds to the same double in both queries.
    EXPECT_EQ(ask(At(0.5, 0, 1), At(0.5 + side, 0.25, 0), &cache), exactly);
    EXPECT_EQ(ask(At(0.5, 0, 1), At(0.5 + side, 0.25, 0x1p-60), &cache), exactly);
    EXPECT_EQ(ask(At(0.5, 0, 1), At(0.5 + side, 0.25, 0x1p-60), &cache), from_cache);
    // A contact that the smallest step ends.
    const Pose apart = At(std::nextafter(0.5 + side, 4 * side), 0.25, 0);
    EXPECT_EQ(ask(X_WA, apart, &cache).first, Relation::kSeparated);
    const Pose into = At(std::nextafter(0.5 + side, 0.5), 0.25, 0);
    EXPECT_EQ(ask(X_WA, into, &cache).first, Relation::kOverlapping);
    EXPECT_EQ(ask(X_WA, X_WB, &cache).first, Relation::kTouching);
    // Another quaternion of the same rotation is not recognized, and with a tolerance, less
    // evidence is required.
    Pose turned = X_WB;
    turned.q = {2, 0, 0, 0};
    EXPECT_EQ(ask(X_WA, turned, &cache), exactly);
    EXPECT_EQ(ask(X_WA, turned, &cache, 0.125), ask(X_WA, turned, nullptr, 0.125));
    // Another hull may replace one that touched.
    EXPECT_EQ(ask(X_WA, turned, &cache).first, Relation::kTouching);
    EXPECT_EQ(ask(X_WA, turned, &cache), from_cache);
    cache.ForgetHulls();
    EXPECT_EQ(ask(X_WA, turned, &cache), exactly);
  }
}

// A box slides on another one, lifts off, and sinks in.
TEST(Collision, TheContactOfHullsThatSlideIsKeptInTheCache) {
  const Hull cube = UnitCube();
  const QueryHull query_cube(cube);
  const PlacedHull a(query_cube, At(0.5, 0.25, 0));
  for (const double side : {1.0, -1.0}) {
    PairCache cache;
    for (int i = -12; i <= 12; ++i) {
      const double x = 0.5 + 0.0625 * i;
      const PlacedHull b(query_cube, At(x, 0.375, side));
      if (i > -12) {
        // The cache is for the pair in the order of content.
        const FloatPair pair = x <= 0.5 ? FloatPair(b, a) : FloatPair(a, b);
        PairCache mirrored = cache;
        if (x <= 0.5) {
          mirrored.axis = -*cache.axis;
          for (uint32_t k = 0; k < cache.pair_count; ++k) {
            std::swap(mirrored.pairs[k].a, mirrored.pairs[k].b);
          }
        }
        const FloatSearchResult hint = TryCached(pair, mirrored);
        EXPECT_EQ(hint.verdict, FloatVerdict::kUndecided);
        EXPECT_EQ(hint.pair_count, 3u);
      }
      const auto ask = [&](double z, PairCache* into) {
        return CheckCollision(a, PlacedHull(query_cube, At(x, 0.375, z)), {}, into)->relation;
      };
      PairCache before = cache;
      EXPECT_EQ(ask(std::nextafter(side, 2 * side), &before), Relation::kSeparated);
      before = cache;
      EXPECT_EQ(ask(std::nextafter(side, 0), &before), Relation::kOverlapping);
      before = cache;
      EXPECT_EQ(ask(4 * side, &before), Relation::kSeparated);
      EXPECT_EQ(ask(side, &cache), Relation::kTouching) << i;
      EXPECT_TRUE(cache.axis.has_value());
    }
  }
}

// The cube takes the pose of the bar, and the bar that of the cube.
TEST(Collision, HullsThatTouchedAreDecidedAgainIfTheySwapPoses) {
  const Hull cube = UnitCube();
  std::vector<Vector> points(cube.vertices().begin(), cube.vertices().end());
  for (Vector& v : points) {
    if (v.x() > 0) v.x() *= 4;
  }
  const Hull bar = BuildHull(points);
  const QueryHull query_cube(cube);
  const QueryHull query_bar(bar);
  const Pose left = At(0, 0, 0);
  const Pose right = At(1, 0, 0);
  PairCache cache;
  EXPECT_EQ(CheckCollision(PlacedHull(query_cube, left), PlacedHull(query_bar, right), {}, &cache)
                ->relation,
            Relation::kTouching);
  EXPECT_EQ(CheckCollision(PlacedHull(query_cube, right), PlacedHull(query_bar, left), {}, &cache)
                ->relation,
            Relation::kOverlapping);
}

TEST(Collision, ACacheOfTouchingHullsChangesNoDetail) {
  const Hull cube = UnitCube();
  const QueryHull query_cube(cube);
  const PlacedHull a(query_cube, At(0, 0, 0));
  const PlacedHull b(query_cube, At(0.25, 1, 0.5));
  PairCache cache;
  EXPECT_EQ(CheckCollision(a, b, {}, &cache)->relation, Relation::kTouching);
  QueryOptions everything;
  everything.want_axis = everything.want_separation = everything.want_witness = true;
  everything.want_certificate = everything.want_normal = true;
  const Answer cold = CheckCollision(a, b, everything).value();
  const Answer warm = CheckCollision(a, b, everything, &cache).value();
  EXPECT_EQ(warm.axis->direction, cold.axis->direction);
  EXPECT_EQ(warm.witness->p_WA, cold.witness->p_WA);
  EXPECT_EQ(warm.certificate->pairs, cold.certificate->pairs);
  EXPECT_EQ(warm.rung, Rung::kExact);
}

TEST(Collision, TheTextbookMethodMakesIntegersOnlyForAxesThatFloatingPointLeavesOpen) {
  std::vector<Vector> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(std::cos(i), std::sin(i), i % 2);
  const Hull drum = BuildHull(points);
  const QueryHull query_drum(drum);
  const PlacedHull a(query_drum, Pose());
  const QueryOptions options = Options(Method::kTextbookSat);
  const auto memory = [&](const Pose& X_WB, Relation relation) {
    const PlacedHull b(query_drum, X_WB);
    TextbookCheck check = TextbookCheck::Begin(a, b, options).value();
    EXPECT_TRUE(check.Advance(std::chrono::steady_clock::time_point::max()).value());
    const size_t bytes = check.MemoryBytes();
    EXPECT_EQ(check.Finish()->relation, relation);
    return bytes;
  };
  const size_t far = memory(At(5, 0.5, 0.25), Relation::kSeparated);
  EXPECT_LT(far, 8000u);
  EXPECT_GT(memory(At(0, 0, 1), Relation::kTouching), far + 80 * 100);
}

TEST(Collision, RefusesInvalidPosesOfEitherHull) {
  const Hull cube = UnitCube();
  Pose no_rotation;
  no_rotation.q = {0, 0, 0, 0};
  Pose bad_rotation;
  bad_rotation.q[3] = kNan;
  for (Method method : {Method::kCertifiedSearch, Method::kTextbookSat}) {
    for (const Pose& bad : {no_rotation, bad_rotation, At(0, kInfinity, 0), At(kNan, 0, 0)}) {
      const QueryOptions options = Options(method);
      EXPECT_EQ(CheckCollision(cube, bad, cube, Pose(), options).status().code(),
                absl::StatusCode::kInvalidArgument);
      EXPECT_EQ(CheckCollision(cube, Pose(), cube, bad, options).status().code(),
                absl::StatusCode::kInvalidArgument);
      EXPECT_EQ(CheckCollision(Hull(), bad, cube, Pose(), options).status().code(),
                absl::StatusCode::kInvalidArgument);
    }
  }
}

TEST(Collision, PoseErrorsNameTheCoordinate) {
  Pose pose;
  pose.q[1] = kNan;
  EXPECT_THAT(std::string(ValidatePose(pose).message()), HasSubstr("rotation.x is NaN"));
  EXPECT_THAT(std::string(ValidatePose(At(0, 0, -kInfinity)).message()),
              HasSubstr("translation.z is infinite"));
  pose.q = {0, -0.0, 0, 0};
  EXPECT_THAT(std::string(ValidatePose(pose).message()), HasSubstr("rotation is zero"));
  pose.q = {5e-324, 0, 0, 0};
  EXPECT_TRUE(ValidatePose(pose).ok());
}

TEST(Collision, NoAxisUnlessRequested) {
  const Hull cube = UnitCube();
  for (Method method : {Method::kCertifiedSearch, Method::kTextbookSat}) {
    QueryOptions options = Options(method);
    options.want_axis = false;
    EXPECT_FALSE(CheckCollision(cube, Pose(), cube, At(2, 0, 0), options)->axis.has_value());
    options.want_axis = true;
    EXPECT_TRUE(CheckCollision(cube, Pose(), cube, At(2, 0, 0), options)->axis.has_value());
    EXPECT_FALSE(CheckCollision(cube, Pose(), cube, At(0.5, 0, 0), options)->axis.has_value());
  }
}

TEST(Collision, AxesOfAFlatDifferenceCountAgainstTheLimit) {
  HullBuilder builder;
  ASSERT_TRUE(builder.Add(std::vector<Vector>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).ok());
  const Hull triangle = builder.Snapshot();
  QueryOptions options;
  options.method = Method::kTextbookSat;
  // 1 + 1 normals, 3 x 3 cross products; the plane's normal and 3 + 3 in-plane normals.
  options.max_textbook_axes = 18;
  options.want_analysis = true;
  EXPECT_EQ(CheckCollision(triangle, Pose(), triangle, Pose(), options)->analysis->axes_total, 18u);
  options.max_textbook_axes = 17;
  EXPECT_TRUE(absl::IsResourceExhausted(
      CheckCollision(triangle, Pose(), triangle, Pose(), options).status()));
}

TEST(Collision, StageIsTheKindOfTheAxisEvenIfTheAxisIsNotRequested) {
  const Hull cube = UnitCube();
  for (const Pose& pose : {At(2, 0, 0), At(1, 0, 0), At(1, 1, 1), At(3, 2, 1)}) {
    QueryOptions options;
    EXPECT_FALSE(CheckCollision(cube, Pose(), cube, pose, options)->analysis.has_value());
    options.want_analysis = true;
    const Answer stage_only = CheckCollision(cube, Pose(), cube, pose, options).value();
    EXPECT_FALSE(stage_only.axis.has_value());
    options.want_axis = true;
    const Answer both = CheckCollision(cube, Pose(), cube, pose, options).value();
    ASSERT_TRUE(both.axis.has_value());
    EXPECT_EQ(stage_only.analysis->stage, both.axis->kind);
  }
}

// Vertex 4x + 2y + z: the cube's facet at x = 0 is the first, that at x = 1 the last. An axis is a
// line, so the first normal separates, and A's feature on it is the last facet.
TEST(Collision, TextbookNamesTheFacetThatSeparates) {
  const Hull cube = UnitCube();
  const Answer answer =
      CheckCollision(cube, Pose(), cube, At(2, 0, 0), Options(Method::kTextbookSat)).value();
  ASSERT_TRUE(answer.axis.has_value());
  EXPECT_EQ(answer.axis->kind, AxisKind::kFacetA);
  EXPECT_EQ(answer.axis->direction, Vector(1, 0, 0));
  EXPECT_THAT(answer.axis->feature_a.facet, testing::Optional(5u));
  EXPECT_THAT(answer.axis->feature_a.vertices, ElementsAre(4, 5, 6, 7));
  EXPECT_THAT(answer.axis->feature_b.vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(answer.analysis->axes_total, 6u + 6u + 12u * 12u);
  EXPECT_THAT(answer.analysis->axis_index, testing::Optional(0u));
  EXPECT_EQ(answer.analysis->axes_tested, 1u);
  EXPECT_THAT(answer.analysis->stage, testing::Optional(AxisKind::kFacetA));
}

// Directions tried by exact arithmetic count even if floating point is unusable.
TEST(Collision, CountsTheDirectionsOfExactSearches) {
  const Hull cube = BuildHull(Scaled(LatticeCube(2, 1), 0x1p1000));
  for (const double shift : {0.25, 1.0, 1.5}) {
    const Answer answer = CheckCollision(cube, Pose(), cube, At(shift * 0x1p1000, 0, 0),
                                         Options(Method::kCertifiedSearch))
                              .value();
    EXPECT_EQ(answer.rung, Rung::kExact);
    EXPECT_GT(answer.analysis->axes_tested, 0u) << shift;
  }
}

// Only the cross product of two edges separates these two needles of cubes.
TEST(Collision, TextbookNamesEdgesThatAloneSeparate) {
  // Cubes on their edges: A's upper edge along y, B's lower edge along x.
  const std::vector<Vector> roof = {{-1, -9, -1}, {0, -9, 0}, {1, -9, -1}, {0, -9, -2},
                                    {-1, 9, -1},  {0, 9, 0},  {1, 9, -1},  {0, 9, -2}};
  std::vector<Vector> keel;
  for (const Vector& p : roof) keel.emplace_back(p.y(), p.x(), -p.z());
  const Hull a = BuildHull(roof);
  const Hull b = BuildHull(keel);
  for (double gap : {0.25, 0.0}) {
    const Answer answer =
        CheckCollision(a, Pose(), b, At(0, 0, gap), Options(Method::kTextbookSat)).value();
    EXPECT_EQ(answer.relation, gap > 0 ? Relation::kSeparated : Relation::kTouching);
    ASSERT_TRUE(answer.axis.has_value());
    EXPECT_EQ(answer.axis->kind, AxisKind::kEdgeEdge);
    EXPECT_EQ(answer.axis->direction, Vector(0, 0, 1));
    EXPECT_EQ(answer.axis->feature_a.vertices.size(), 2u);
    EXPECT_EQ(answer.axis->feature_b.vertices.size(), 2u);
  }
}

TEST(Collision, TextbookRefusesMoreAxesThanAllowed) {
  const Hull cube = UnitCube();
  QueryOptions options = Options(Method::kTextbookSat);
  options.max_textbook_axes = 155;
  for (const Pose& pose : {At(0.5, 0, 0), At(9, 0, 0)}) {
    const absl::Status status = CheckCollision(cube, Pose(), cube, pose, options).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  }
  options.max_textbook_axes = 156;
  EXPECT_TRUE(CheckCollision(cube, Pose(), cube, At(0.5, 0, 0), options).ok());
  // The limit applies to the textbook only.
  options.method = Method::kCertifiedSearch;
  options.max_textbook_axes = 0;
  EXPECT_TRUE(CheckCollision(cube, Pose(), cube, At(0.5, 0, 0), options).ok());
}

void ExpectSameAxis(const Answer& actual, const Answer& expected) {
  ASSERT_EQ(actual.axis.has_value(), expected.axis.has_value());
  if (!expected.axis) return;
  EXPECT_EQ(actual.axis->direction, expected.axis->direction);
  EXPECT_EQ(actual.axis->kind, expected.axis->kind);
  EXPECT_EQ(actual.axis->feature_a.vertices, expected.axis->feature_a.vertices);
  EXPECT_EQ(actual.axis->feature_b.vertices, expected.axis->feature_b.vertices);
  EXPECT_EQ(actual.axis->feature_a.facet, expected.axis->feature_a.facet);
  EXPECT_EQ(actual.axis->feature_b.facet, expected.axis->feature_b.facet);
}

TEST(Collision, TextbookReportsTheSameOnAnyNumberOfThreads) {
  Random random(601);
  for (int round = 0; round < 30; ++round) {
    const Hull a = BuildHull(RandomInBall(random, 30, 1));
    const Hull b = BuildHull(RandomInBall(random, 30, 1));
    Pose X_WB = At(random.Real(0, 2), random.Real(0, 1), 0);
    for (double& q : X_WB.q) q = random.Real(-1, 1);
    // A third of the pairs touches: B is A's mirror image at its least vertex.
    const bool touching = round % 3 == 0;
    if (touching) X_WB = At(0, 0, 0);
    std::vector<Vector> mirrored;
    for (const Vector& p : a.vertices()) mirrored.push_back(-p);
    const Hull& other = touching ? BuildHull(mirrored) : b;
    const Pose X_WA =
        touching ? At(-a.vertices()[0].x(), -a.vertices()[0].y(), -a.vertices()[0].z()) : Pose();
    if (touching) X_WB.t = a.vertices()[0];
    QueryOptions options = Options(Method::kTextbookSat);
    const Answer expected = CheckCollision(a, X_WA, other, X_WB, options).value();
    if (touching) {
      EXPECT_EQ(expected.relation, Relation::kTouching);
    }
    for (int threads : {2, 3, 8}) {
      options.threads = threads;
      const Answer answer = CheckCollision(a, X_WA, other, X_WB, options).value();
      EXPECT_EQ(answer.relation, expected.relation);
      EXPECT_EQ(answer.rung, expected.rung);
      EXPECT_EQ(answer.analysis->axes_tested, expected.analysis->axes_tested);
      EXPECT_EQ(answer.analysis->axis_index, expected.analysis->axis_index);
      EXPECT_EQ(answer.analysis->stage, expected.analysis->stage);
      ExpectSameAxis(answer, expected);
    }
  }
}

TEST(Collision, AnswersAreTheSameEachTime) {
  Random random(602);
  for (int round = 0; round < 50; ++round) {
    const Hull a = BuildHull(RandomInBall(random, 40, 1));
    const Hull b = BuildHull(RandomInBall(random, 40, 1));
    const Pose X_WB = At(random.Real(0, 2.2), 0.1, 0.2);
    const QueryOptions options = Options(Method::kCertifiedSearch);
    const Answer first = CheckCollision(a, Pose(), b, X_WB, options).value();
    const Answer second = CheckCollision(a, Pose(), b, X_WB, options).value();
    EXPECT_EQ(first.relation, second.relation);
    EXPECT_EQ(first.rung, second.rung);
    EXPECT_EQ(first.analysis->axes_tested, second.analysis->axes_tested);
    ExpectSameAxis(first, second);
  }
}

AxisKind MirroredKind(AxisKind kind) {
  if (kind == AxisKind::kFacetA) return AxisKind::kFacetB;
  if (kind == AxisKind::kFacetB) return AxisKind::kFacetA;
  return kind;
}

TEST(Collision, SwappingTheHullsMirrorsTheAnswerOfTheSearch) {
  Random random(603);
  int axes = 0;
  for (int round = 0; round < 200; ++round) {
    const Hull a = BuildHull(RandomInBall(random, random.Between(1, 30), 1));
    const Hull b = BuildHull(RandomInBall(random, random.Between(1, 30), 1));
    Pose X_WA, X_WB;
    for (double& q : X_WA.q) q = random.Real(-1, 1);
    X_WB.t = Vector(random.Real(-2, 2), random.Real(-2, 2), random.Real(-2, 2));
    const QueryOptions options = Options(Method::kCertifiedSearch);
    const Answer there = CheckCollision(a, X_WA, b, X_WB, options).value();
    const Answer back = CheckCollision(b, X_WB, a, X_WA, options).value();
    ASSERT_EQ(there.relation, back.relation);
    EXPECT_EQ(there.rung, back.rung);
    ASSERT_EQ(there.axis.has_value(), back.axis.has_value());
    if (!there.axis) continue;
    ++axes;
    EXPECT_EQ(there.axis->kind, MirroredKind(back.axis->kind)) << round;
    EXPECT_EQ(there.axis->direction, -back.axis->direction) << round;
    EXPECT_EQ(there.axis->feature_a.vertices, back.axis->feature_b.vertices) << round;
    EXPECT_EQ(there.axis->feature_b.vertices, back.axis->feature_a.vertices) << round;
  }
  EXPECT_GT(axes, 50);
}

// A cancelled textbook query on about 2000 x 2000 edges stops soon.
TEST(Collision, CancellationEndsTheTextbook) {
  const Hull sphere = BuildHull(FibonacciSphere(600));
  for (int threads : {1, 4}) {
    QueryOptions options = Options(Method::kTextbookSat);
    options.threads = threads;
    std::atomic<int> polls = 0;
    options.should_stop = [&] { return ++polls > 3; };
    const absl::Status status =
        CheckCollision(sphere, Pose(), sphere, At(0.1, 0.2, 0.3), options).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kCancelled) << status;
    EXPECT_LT(polls, 1000);
  }
}

TEST(Collision, ShouldStopThatReturnsFalseChangesNothing) {
  const Hull sphere = BuildHull(FibonacciSphere(100));
  for (Method method : {Method::kCertifiedSearch, Method::kTextbookSat}) {
    QueryOptions options = Options(method);
    options.should_stop = [] { return false; };
    EXPECT_EQ(CheckCollision(sphere, Pose(), sphere, At(0.1, 0, 0), options)->relation,
              Relation::kOverlapping);
  }
}

// A translation beyond the range where sums of coordinates are finite.
TEST(Collision, SumsBeyondTheRangeOfDoublesAreExact) {
  const Hull cube = BuildHull(Shifted(LatticeCube(2, 3e307), Vector::Constant(-1.5e307)));
  const double largest = std::numeric_limits<double>::max();
  RelationCheck check;
  EXPECT_TRUE(check.Verify(cube, At(largest, largest, 0), cube, At(-largest, -largest, 0),
                           Relation::kSeparated));
  EXPECT_TRUE(
      check.Verify(cube, At(largest, 0, 0), cube, At(largest, 1e300, 0), Relation::kOverlapping));
}

}  // namespace collision_contract_test
}  // namespace hulld
