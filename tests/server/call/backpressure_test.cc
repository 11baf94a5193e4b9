// A client that sends fast or reads slowly fills gRPC's windows, not the server's memory.

#include <gtest/gtest.h>
#include <prometheus/text_serializer.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <random>
#include <string>

#include "tests/server/harness/test_server.h"

#ifdef HULLD_SANITIZED
// Every sanitizer's runtime has it; GCC 12 comes without its header.
extern "C" size_t __sanitizer_get_current_allocated_bytes();
#endif

namespace hulld::server {
namespace backpressure_test {

constexpr double kMebibyte = 1 << 20;

// Returns the memory of this process, client and server: resident, or allocated if a sanitizer
// retains freed memory to detect its use.
double BytesHeld() {
#ifdef HULLD_SANITIZED
  return static_cast<double>(__sanitizer_get_current_allocated_bytes());
#else
  FILE* const file = std::fopen("/proc/self/statm", "r");
  unsigned long long total = 0;
  unsigned long long resident = 0;
  EXPECT_EQ(std::fscanf(file, "%llu %llu", &total, &resident), 2);
  std::fclose(file);
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
#endif
}

class Backpressure : public ServerTest {
 protected:
  double PairsAnswered() const {
    double sum = 0;
    for (const prometheus::MetricFamily& family : server_->metrics().Collect()) {
      if (family.name != "hulld_pairs_total") continue;
      for (const prometheus::ClientMetric& metric : family.metric) sum += metric.counter.value;
    }
    return sum;
  }

  // Answers of 72 bytes each.
  static v1::BatchCheckCollisionsRequest Batch(int pairs) {
    v1::BatchCheckCollisionsRequest request;
    request.mutable_wanted()->set_separation(true);
    request.mutable_wanted()->set_witness(true);
    *request.add_placements() = PlacementOf("cube");
    *request.add_placements() = PlacementOf("cube", 9);
    for (int i = 0; i < pairs; ++i) {
      request.add_pairs(0);
      request.add_pairs(1);
    }
    return request;
  }
};

// A writer that never waits for an ack sends 300 MB; queued chunks would stay in memory.
TEST_F(Backpressure, MemoryStaysFlatWhilePointsStreamIn) {
  constexpr int kChunks = 250;
  constexpr int kPointsPerChunk = 50'000;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  Coordinates points(3 * kPointsPerChunk);
  for (double& x : points) x = coordinate(random);
  v1::AppendPointsRequest chunk = ChunkMessage(1, points);
  Appender appender(*hulls_, "cloud", "w", true);
  ASSERT_TRUE(appender.is_open());
  ASSERT_TRUE(appender.Send(chunk));
  ASSERT_TRUE(appender.ReadAck().has_value());
  const double before = BytesHeld();
  double most = before;
  for (int i = 2; i <= kChunks; ++i) {
    chunk.mutable_chunk()->set_sequence(i);
    ASSERT_TRUE(appender.Send(chunk));
    most = std::max(most, BytesHeld());
  }
  ASSERT_TRUE(appender.Finish().ok());
  EXPECT_EQ(Get("cloud").hull().counts().received(), uint64_t{kChunks} * kPointsPerChunk);
  EXPECT_LT((most - before) / kMebibyte, 100) << "of " << kChunks * 1.2 << " MB sent";
}

// Both batches take turns: when the one that is read ends, the other is far behind if it is
// throttled, and at its end if not.
TEST_F(Backpressure, AnUnreadBatchIsNotComputedAhead) {
  constexpr int kPairs = 500'000;
  Put("cube", Cube());
  const v1::BatchCheckCollisionsRequest request = Batch(kPairs);
  grpc::ClientContext unread_context;
  const auto unread = collisions_->BatchCheckCollisions(&unread_context, request);
  v1::BatchCheckCollisionsResponse part;
  ASSERT_TRUE(unread->Read(&part));
  grpc::ClientContext context;
  const auto read = collisions_->BatchCheckCollisions(&context, request);
  while (read->Read(&part)) {
  }
  ASSERT_TRUE(read->Finish().ok());
  const double ahead = PairsAnswered() - kPairs;
  EXPECT_GT(ahead, 0);
  EXPECT_LT(ahead, kPairs / 2);
  unread_context.TryCancel();
  while (unread->Read(&part)) {
  }
  EXPECT_FALSE(unread->Finish().ok());
}

// Every pair is found, with a certificate of a few hundred bytes. The unread scene delays no other
// call, so it need not be ended, and completes when the client resumes reading.
TEST_F(Backpressure, AnUnreadSceneIsNotSearchedAhead) {
  constexpr int kPlacements = 600;
  constexpr double kPairs = kPlacements * (kPlacements - 1) / 2.0;
  Put("ball", Sphere(20));
  v1::FindCollisionsRequest request;
  for (int i = 0; i < kPlacements; ++i) *request.add_placements() = PlacementOf("ball", 1e-6 * i);
  request.mutable_wanted()->set_certificate(true);
  grpc::ClientContext unread_context;
  const auto unread = collisions_->FindCollisions(&unread_context, request);
  v1::FindCollisionsResponse part;
  ASSERT_TRUE(unread->Read(&part));
  grpc::ClientContext context;
  const auto read = collisions_->FindCollisions(&context, request);
  while (read->Read(&part)) {
  }
  ASSERT_TRUE(read->Finish().ok());
  EXPECT_EQ(part.totals().overlapping(), kPairs);
  EXPECT_LT(PairsAnswered() - kPairs, kPairs / 2);
  double found = 0;
  while (unread->Read(&part)) found += part.pairs_size() / 2.0;
  EXPECT_TRUE(unread->Finish().ok());
  EXPECT_EQ(found, kPairs);
}

// One step of a stream of poses answers all pairs; the client reads none of it.
TEST_F(Backpressure, AnUnreadStepOfAStreamIsNotComputedAhead) {
  constexpr int kPairs = 500'000;
  Put("cube", Cube());
  const v1::BatchCheckCollisionsRequest batch = Batch(kPairs);
  v1::StreamCollisionsRequest open;
  *open.mutable_open()->mutable_wanted() = batch.wanted();
  *open.mutable_open()->mutable_placements() = batch.placements();
  *open.mutable_open()->mutable_pairs() = batch.pairs();
  grpc::ClientContext unread_context;
  const auto unread = collisions_->StreamCollisions(&unread_context);
  ASSERT_TRUE(unread->Write(open));
  v1::StreamCollisionsResponse first;
  ASSERT_TRUE(unread->Read(&first));
  grpc::ClientContext context;
  const auto read = collisions_->StreamCollisions(&context);
  ASSERT_TRUE(read->Write(open));
  v1::StreamCollisionsResponse part;
  while (read->Read(&part) && !part.last()) {
  }
  ASSERT_TRUE(part.last());
  const double ahead = PairsAnswered() - kPairs;
  EXPECT_GT(ahead, 0);
  EXPECT_LT(ahead, kPairs / 2);
  unread_context.TryCancel();
  while (unread->Read(&part)) {
  }
  EXPECT_FALSE(unread->Finish().ok());
  read->WritesDone();
  EXPECT_TRUE(read->Finish().ok());
}

}  // namespace backpressure_test
}  // namespace hulld::server
