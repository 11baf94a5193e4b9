// Memory that textbook pairs use between slices, and its accounting.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>

#include "tests/server/harness/test_server.h"
#include "tests/test_size.h"

namespace hulld::server {
namespace textbook_memory_test {

using ::testing::HasSubstr;

// Returns a square that touches the points from above in x. Floating point leaves the axis of its
// facet, the first one, open, so all vertices are multiplied out in integers.
Coordinates Beside(const Coordinates& points) {
  double top = points[0];
  for (size_t i = 3; i < points.size(); i += 3) top = std::max(top, points[i]);
  return {top, -1, -1, top, 1, -1, top, 1, 1, top, -1, 1};
}

class TextbookMemory : public ServerTest {
 protected:
  // Puts a sphere with vertices that, multiplied out in integers, exceed the readers' share.
  void PutLarge() {
    Config config = TestConfig();
    config.limits.memory_limit = 35'000'000;
    Restart(config);
    Put("large", Sphere(kVertices));
    Put("beside", Beside(Sphere(kVertices)));
    Put("cube", Cube(-0.5));
    // Makes the canonical snapshots.
    for (const char* other : {"beside", "cube"}) {
      v1::CheckCollisionRequest request = Query("large", other);
      request.set_method(v1::METHOD_UNSPECIFIED);
      request.mutable_wanted()->set_certificate(true);
      Check(request);
    }
    before_ = HeldBytes();
  }
  static v1::CheckCollisionRequest Query(const std::string& a, const std::string& b) {
    v1::CheckCollisionRequest request;
    request.set_method(v1::METHOD_TEXTBOOK_SAT);
    *request.mutable_a() = PlacementOf(a);
    *request.mutable_b() = PlacementOf(b);
    return request;
  }
  // Bytes counted against the limit.
  double HeldBytes() const {
    for (const prometheus::MetricFamily& family : server_->metrics().Collect()) {
      if (family.name == "hulld_cache_bytes") return family.metric.front().gauge.value;
    }
    return 0;
  }
  bool IsCounted() const { return HeldBytes() > before_ + kVertices * 400.0; }
  void ExpectRefused(const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("(--memory-limit)"));
  }

  static constexpr int kVertices = 40'000;
  double before_ = 0;
};

TEST_F(TextbookMemory, AStartedPairIsCountedAndFurtherOnesAreRefused) {
  PutLarge();
  grpc::ClientContext context;
  grpc::Status status;
  std::atomic<bool> is_answered = false;
  std::thread first([&] {
    v1::CheckCollisionResponse response;
    status = collisions_->CheckCollision(&context, Query("beside", "large"), &response);
    is_answered = true;
  });
  while (!IsCounted() && !is_answered) std::this_thread::yield();
  EXPECT_FALSE(is_answered);
  ExpectRefused(CheckError(Query("large", "cube")));
  // A small pair is still answered.
  EXPECT_EQ(Check(Query("cube", "cube")).relation(), v1::RELATION_OVERLAPPING);
  context.TryCancel();
  first.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
}

// This also holds while it waits for its next slice.
TEST_F(TextbookMemory, ABatchIsCountedFromSliceToSlice) {
  PutLarge();
  v1::BatchCheckCollisionsRequest request;
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  *request.add_placements() = PlacementOf("beside");
  *request.add_placements() = PlacementOf("large");
  *request.add_placements() = PlacementOf("cube");
  request.add_pairs(0);
  request.add_pairs(1);
  for (int pair = 0; pair < 100'000; ++pair) {
    request.add_pairs(2);
    request.add_pairs(2);
  }
  grpc::ClientContext context;
  const auto reader = collisions_->BatchCheckCollisions(&context, request);
  std::atomic<bool> is_answered = false;
  std::thread answers([&] {
    v1::BatchCheckCollisionsResponse part;
    while (reader->Read(&part)) {
      if (part.columns().relations_size() > 0) is_answered = true;
    }
  });
  while (!IsCounted() && !is_answered) std::this_thread::yield();
  for (int look = 0; look < 100 && !is_answered; ++look) EXPECT_TRUE(IsCounted());
  ExpectRefused(CheckError(Query("large", "cube")));
  EXPECT_FALSE(is_answered);
  context.TryCancel();
  answers.join();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

// Two of these pairs hold more than the readers' share of the limit.
TEST_F(TextbookMemory, ABatchBeginsOneLargePairAtATime) {
  Config config = TestConfig();
  config.limits.memory_limit = 16 << 20;
  Restart(config);
  Put("large", Sphere(5000));
  Put("beside", Beside(Sphere(5000)));
  v1::BatchCheckCollisionsRequest request;
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  *request.add_placements() = PlacementOf("beside");
  *request.add_placements() = PlacementOf("large");
  constexpr int kPairs = TestSize(4, 2);
  for (int pair = 0; pair < kPairs; ++pair) {
    request.add_pairs(0);
    request.add_pairs(1);
  }
  grpc::ClientContext context;
  const auto reader = collisions_->BatchCheckCollisions(&context, request);
  int touching = 0;
  v1::BatchCheckCollisionsResponse part;
  while (reader->Read(&part)) {
    for (const int relation : part.columns().relations()) {
      touching += relation == v1::RELATION_TOUCHING ? 1 : 0;
    }
  }
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(touching, kPairs);
}

}  // namespace textbook_memory_test
}  // namespace hulld::server
