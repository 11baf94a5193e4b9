// A query always returns the same bits: on every SIMD path, in either order, and with a warm cache
// as far as core/README.md promises it (Exactness, determinism).

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/numeric/simd_path.h"
#include "core/query/collision.h"
#include "tests/bench/queries/accuracy_suite.h"
#include "tests/core/checks/extreme_clouds.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld {
namespace determinism_test {

constexpr size_t kStride = TestSize(5, 37);

// Selects a SIMD path and restores the previous one on destruction.
class OnPath {
 public:
  explicit OnPath(SimdPath path) : before_(CurrentSimdPath()) { EXPECT_TRUE(UseSimdPath(path)); }
  ~OnPath() { UseSimdPath(before_); }

 private:
  SimdPath before_;
};

QueryOptions Everything() {
  QueryOptions options;
  options.want_axis = true;
  options.want_analysis = true;
  options.want_certificate = true;
  options.want_separation = true;
  options.want_witness = true;
  options.want_normal = true;
  options.clearance = 1e-9;
  return options;
}

// Compares the values that never vary at tolerance 0, according to core/README.md.
void ExpectSameValues(const Answer& actual, const Answer& expected) {
  EXPECT_EQ(actual.relation, expected.relation);
  EXPECT_EQ(actual.separation->value, expected.separation->value);
  EXPECT_EQ(actual.separation->bound, expected.separation->bound);
  EXPECT_EQ(actual.within_clearance, expected.within_clearance);
}

void ExpectSameBits(const Answer& actual, const Answer& expected) {
  ExpectSameValues(actual, expected);
  EXPECT_EQ(actual.rung, expected.rung);
  EXPECT_EQ(actual.analysis->axes_tested, expected.analysis->axes_tested);
  ASSERT_EQ(actual.axis.has_value(), expected.axis.has_value());
  if (expected.axis) {
    EXPECT_EQ(actual.axis->direction, expected.axis->direction);
    EXPECT_EQ(actual.axis->kind, expected.axis->kind);
    EXPECT_EQ(actual.axis->feature_a.vertices, expected.axis->feature_a.vertices);
    EXPECT_EQ(actual.axis->feature_b.vertices, expected.axis->feature_b.vertices);
  }
  ASSERT_EQ(actual.certificate.has_value(), expected.certificate.has_value());
  if (expected.certificate) {
    EXPECT_TRUE(actual.certificate->direction == expected.certificate->direction);
    EXPECT_EQ(actual.certificate->pairs, expected.certificate->pairs);
  }
  ASSERT_EQ(actual.witness.has_value(), expected.witness.has_value());
  if (expected.witness) {
    EXPECT_EQ(actual.witness->p_WA, expected.witness->p_WA);
    EXPECT_EQ(actual.witness->p_WB, expected.witness->p_WB);
    EXPECT_EQ(actual.witness->error, expected.witness->error);
  }
  ASSERT_EQ(actual.normal.has_value(), expected.normal.has_value());
  if (expected.normal) {
    EXPECT_EQ(actual.normal->direction, expected.normal->direction);
    EXPECT_EQ(actual.normal->angle_bound, expected.normal->angle_bound);
  }
}

class Determinism : public testing::Test {
 protected:
  const bench::AccuracySuite suite_ = bench::MakeAccuracySuite(kStride);

  Answer Query(const bench::QuerySet::Query& query) const {
    return CheckCollision(suite_.hulls[query.hull_a], query.X_WA, suite_.hulls[query.hull_b],
                          query.X_WB, Everything())
        .value();
  }
  Answer QuerySwapped(const bench::QuerySet::Query& query) const {
    return CheckCollision(suite_.hulls[query.hull_b], query.X_WB, suite_.hulls[query.hull_a],
                          query.X_WA, Everything())
        .value();
  }
};

TEST_F(Determinism, SimdPathsGiveTheSameAnswers) {
  const OnPath fast(BestSimdPath());
  if (BestSimdPath() == SimdPath::kPortable) GTEST_SKIP() << "this machine has only one SIMD path";
  for (size_t i = 0; i < suite_.queries.size(); ++i) {
    const Answer expected = Query(suite_.queries[i]);
    for (const SimdPath path : {SimdPath::kPortable, SimdPath::kAvx2}) {
      if (!UseSimdPath(path)) continue;
      SCOPED_TRACE(testing::Message() << suite_.kinds[i] << ", query " << i);
      ExpectSameBits(Query(suite_.queries[i]), expected);
    }
    UseSimdPath(BestSimdPath());
    if (HasFailure()) break;
  }
}

TEST_F(Determinism, SimdPathsBuildTheSameHulls) {
  const OnPath fast(BestSimdPath());
  if (BestSimdPath() == SimdPath::kPortable) GTEST_SKIP() << "this machine has only one SIMD path";
  std::vector<std::vector<Vector>> clouds;
  for (const Extreme& extreme : Extremes()) clouds.push_back(extreme.make(600));
  Random random(TestSeed(1701));
  // Large enough for conflict lists and the direction map.
  clouds.push_back(RandomInBall(random, 20000, 1));
  clouds.push_back(RandomOnSphere(random, 3000, 1));
  clouds.push_back(LatticeCube(20, 0.1));
  for (size_t i = 0; i < clouds.size(); ++i) {
    HullBuilder on_fast;
    const PointCounts expected = on_fast.Add(clouds[i]).value();
    const OnPath portable(SimdPath::kPortable);
    HullBuilder on_portable;
    EXPECT_EQ(on_portable.Add(clouds[i]).value(), expected) << "cloud " << i;
    EXPECT_TRUE(SameBits(on_portable.Snapshot(), on_fast.Snapshot())) << "cloud " << i;
  }
}

TEST_F(Determinism, SwappingTheHullsMirrorsEveryField) {
  for (size_t i = 0; i < suite_.queries.size(); ++i) {
    const Answer there = Query(suite_.queries[i]);
    Answer back = QuerySwapped(suite_.queries[i]);
    SCOPED_TRACE(testing::Message() << suite_.kinds[i] << ", query " << i);
    if (back.axis) {
      back.axis->direction = -back.axis->direction;
      std::swap(back.axis->feature_a, back.axis->feature_b);
      if (back.axis->kind == AxisKind::kFacetA) {
        back.axis->kind = AxisKind::kFacetB;
      } else if (back.axis->kind == AxisKind::kFacetB) {
        back.axis->kind = AxisKind::kFacetA;
      }
    }
    if (back.certificate) {
      if (auto* n = std::get_if<Vector>(&back.certificate->direction)) *n = -*n;
      if (auto* n = std::get_if<IntegerVector>(&back.certificate->direction)) *n = -*n;
      for (VertexPair& pair : back.certificate->pairs) std::swap(pair.a, pair.b);
    }
    if (back.witness) std::swap(back.witness->p_WA, back.witness->p_WB);
    if (back.normal) back.normal->direction = -back.normal->direction;
    ExpectSameBits(back, there);
    if (HasFailure()) break;
  }
}

TEST_F(Determinism, WarmCachesChangeNoValue) {
  size_t cached = 0;
  for (size_t i = 0; i < suite_.queries.size(); ++i) {
    const bench::QuerySet::Query& query = suite_.queries[i];
    const QueryHull a(suite_.hulls[query.hull_a]);
    const QueryHull b(suite_.hulls[query.hull_b]);
    const Answer cold = Query(query);
    PairCache cache;
    // Warmed by a nearby query, by the query itself, and by the result of both.
    Pose nearby = query.X_WB;
    nearby.t *= 1 + 1e-6;
    const PlacedHull placed_a = PlacedHull::Make(a, query.X_WA).value();
    const PlacedHull placed_b = PlacedHull::Make(b, query.X_WB).value();
    ASSERT_TRUE(CheckCollision(placed_a, PlacedHull::Make(b, nearby).value(), {}, &cache).ok());
    SCOPED_TRACE(testing::Message() << suite_.kinds[i] << ", query " << i);
    for (int round = 0; round < 2; ++round) {
      ExpectSameValues(CheckCollision(placed_a, placed_b, Everything(), &cache).value(), cold);
      const Answer plain = CheckCollision(placed_a, placed_b, {}, &cache).value();
      EXPECT_EQ(plain.relation, cold.relation);
      cached += plain.rung == Rung::kCached;
    }
    if (HasFailure()) break;
  }
  EXPECT_GT(cached, suite_.queries.size() / 4);
}

}  // namespace determinism_test
}  // namespace hulld
