// Memory of a running scene, and its accounting, for any number of collisions.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "tests/server/harness/test_server.h"
#include "tests/test_size.h"

namespace hulld::server {
namespace scene_memory_test {

using ::testing::HasSubstr;

class SceneMemory : public ServerTest {
 protected:
  // Returns the sum of all series of this name.
  double Metric(const std::string& name) const {
    double sum = 0;
    for (const prometheus::MetricFamily& family : server_->metrics().Collect()) {
      if (family.name != name) continue;
      for (const prometheus::ClientMetric& metric : family.metric) {
        sum += metric.counter.value + metric.gauge.value;
      }
    }
    return sum;
  }

  // `placements` cubes at one pose: every pair overlaps.
  static v1::FindCollisionsRequest Heap(int placements) {
    v1::FindCollisionsRequest request;
    v1::PackedPlacements& packed = *request.mutable_packed_placements();
    packed.add_hull_ids("cube");
    for (int i = 0; i < placements; ++i) {
      packed.add_hulls(0);
      for (const double number : {1, 0, 0, 0, 0, 0, 0}) packed.add_poses(number);
    }
    return request;
  }
};

// 2e10 pairs overlap and the client reads no answer. The scene holds the placements, the tree of
// their boxes, and the answers that gRPC has not taken: a few MiB, counted against --memory-limit.
TEST_F(SceneMemory, AnUnreadSceneIsCountedAndBounded) {
  constexpr int kPlacements = 200'000;
  constexpr int kRead = TestSize(1500, 500);
  // Placed hulls, their boxes twice, the tree.
  constexpr double kLeast = kPlacements * 300.0;
  constexpr double kMax = kPlacements * 700.0 + (16 << 20);
  Put("cube", Cube());
  const double before = Metric("hulld_cache_bytes");
  v1::FindCollisionsRequest request = Heap(kPlacements);
  request.mutable_wanted()->set_certificate(true);
  grpc::ClientContext context;
  const auto unread = collisions_->FindCollisions(&context, request);
  // Each is bounded by the test's time limit only.
  while (Metric("hulld_pairs_total") == 0) std::this_thread::yield();
  EXPECT_GT(Metric("hulld_cache_bytes") - before, kLeast);
  // A concurrent scene whose answers are read completes; both take turns.
  grpc::ClientContext read_context;
  const auto read = collisions_->FindCollisions(&read_context, Heap(kRead));
  v1::FindCollisionsResponse part;
  while (read->Read(&part)) EXPECT_LT(Metric("hulld_cache_bytes") - before, kMax);
  ASSERT_TRUE(read->Finish().ok());
  EXPECT_EQ(part.totals().overlapping(), uint64_t{kRead} * (kRead - 1) / 2);
  // 2e10 pairs in total.
  EXPECT_LT(Metric("hulld_pairs_total"), 2e6);
  context.TryCancel();
  while (unread->Read(&part)) {
  }
  EXPECT_EQ(unread->Finish().error_code(), grpc::StatusCode::CANCELLED);
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  EXPECT_LE(Metric("hulld_cache_bytes"), before + (1 << 20));
}

TEST_F(SceneMemory, BeyondTheMemoryLimitIsRefused) {
  Config config = TestConfig();
  config.limits.memory_limit = 4 << 20;
  Restart(config);
  Put("cube", Cube());
  const auto find = [this](int placements) {
    grpc::ClientContext context;
    const auto reader = collisions_->FindCollisions(&context, Heap(placements));
    v1::FindCollisionsResponse part;
    while (reader->Read(&part)) {
      // An admitted scene would take long.
      if (placements > 100 && part.pairs_size() > 0) context.TryCancel();
    }
    return reader->Finish();
  };
  EXPECT_TRUE(find(100).ok());
  const grpc::Status refused = find(20'000);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("(--memory-limit)"));
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  EXPECT_TRUE(find(100).ok());
}

// A batch has the same number of placements.
TEST_F(SceneMemory, ABatchCountsAgainstTheSameLimit) {
  Config config = TestConfig();
  config.limits.memory_limit = 4 << 20;
  Restart(config);
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.mutable_packed_placements() = Heap(20'000).packed_placements();
  request.add_pairs(0);
  request.add_pairs(1);
  grpc::ClientContext context;
  const auto reader = collisions_->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  while (reader->Read(&part)) {
  }
  const grpc::Status refused = reader->Finish();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("(--memory-limit)"));
}

// An error takes more memory than its placement.
TEST_F(SceneMemory, ErrorsOfPlacementsCount) {
  Config config = TestConfig();
  config.limits.memory_limit = 30'000'000;
  Restart(config);
  Put("cube", Cube());
  const auto ask = [this](const std::string& hull_id) {
    v1::BatchCheckCollisionsRequest request;
    for (int i = 0; i < 20'000; ++i) *request.add_placements() = PlacementOf(hull_id);
    request.add_pairs(0);
    request.add_pairs(1);
    grpc::ClientContext context;
    const auto reader = collisions_->BatchCheckCollisions(&context, request);
    v1::BatchCheckCollisionsResponse part;
    while (reader->Read(&part)) {
    }
    return reader->Finish();
  };
  const grpc::Status answered = ask("cube");
  EXPECT_TRUE(answered.ok()) << answered.error_message();
  const grpc::Status refused = ask("-malformed-");
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("(--memory-limit)"));
}

}  // namespace scene_memory_test
}  // namespace hulld::server
