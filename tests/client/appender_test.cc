#include "client/appender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "client/calls/grpc_status.h"
#include "client/client.h"
#include "tests/client/fake_hulld.h"

namespace hulld {
namespace appender_test {

using testing::ElementsAre;
using testing::HasSubstr;

class AppenderTest : public testing::Test {
 protected:
  AppenderTest() { options_.create_if_absent = true; }

  std::unique_ptr<Appender> Open(std::chrono::milliseconds timeout = std::chrono::seconds(30)) {
    ClientOptions options;
    options.server = fake_.address();
    options.timeout = timeout;
    options.retry.max_attempts = 4;
    options.retry.wait = [this](std::chrono::milliseconds wait) {
      waits_.push_back(wait);
      if (before_reconnect_) before_reconnect_();
    };
    auto appender = Client(options).OpenAppend("a", options_);
    EXPECT_TRUE(appender.ok()) << appender.status();
    return appender.ok() ? *std::move(appender) : nullptr;
  }

  // Returns a single-point block with all coordinates equal to `value`.
  static v1::PointBlock Block(double value) {
    v1::PointBlock block;
    for (int i = 0; i < 3; ++i) block.add_xyz(value);
    return block;
  }

  static std::string Text(const absl::Status& status) {
    return std::string(status.message().data(), status.message().size());
  }

  std::vector<double> FirstCoordinates() {
    std::vector<double> values;
    const FakeHull hull = fake_.hull("a");
    for (size_t i = 0; i < hull.xyz.size(); i += 3) values.push_back(hull.xyz[i]);
    return values;
  }

  AppendOptions options_;
  std::function<void()> before_reconnect_;
  std::vector<std::chrono::milliseconds> waits_;
  FakeHulld fake_;
};

TEST_F(AppenderTest, ChunksArriveInOrderAndAreCounted) {
  const auto appender = Open();
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(appender->Append(Block(i)).ok());
  ASSERT_TRUE(appender->Finish().ok());
  const std::vector<double> values = FirstCoordinates();
  ASSERT_EQ(values.size(), 200u);
  for (int i = 0; i < 200; ++i) EXPECT_EQ(values[static_cast<size_t>(i)], i);
  EXPECT_EQ(appender->totals().points_acknowledged, 200u);
  EXPECT_EQ(appender->totals().counts.received(), 200u);
  EXPECT_EQ(appender->totals().vertex_count, 200u);
  EXPECT_EQ(appender->totals().reconnects, 0u);
}

TEST_F(AppenderTest, AStreamWithoutChunksOnlyOpensTheHull) {
  ASSERT_TRUE(Open()->Finish().ok());
  EXPECT_EQ(fake_.hull("a").create_revision, 1u);
}

TEST_F(AppenderTest, AWriterContinuesAfterItsLastSequence) {
  options_.writer_id = "me";
  auto appender = Open();
  ASSERT_TRUE(appender->Append(Block(1)).ok());
  ASSERT_TRUE(appender->Append(Block(2)).ok());
  ASSERT_TRUE(appender->Finish().ok());
  appender = Open();
  EXPECT_EQ(appender->opened().last_sequence(), 2u);
  ASSERT_TRUE(appender->Append(Block(3)).ok());
  ASSERT_TRUE(appender->Finish().ok());
  EXPECT_THAT(FirstCoordinates(), ElementsAre(1, 2, 3));
}

TEST_F(AppenderTest, WritersHaveDistinctNamesByDefault) {
  EXPECT_NE(Open()->writer_id(), Open()->writer_id());
}

TEST_F(AppenderTest, ChunksAreSentAheadOfTheirAcksUpToTheBound) {
  options_.max_in_flight_chunks = 3;
  StreamScript script;
  // Exceeds the deadline if fewer were pipelined.
  script.ack_every = 3;
  fake_.ScriptStreams({script});
  const auto appender = Open();
  for (int i = 0; i < 21; ++i) {
    ASSERT_TRUE(appender->Append(Block(i)).ok());
    EXPECT_LT(appender->totals().points_sent - appender->totals().points_acknowledged, 3u);
  }
  ASSERT_TRUE(appender->Finish().ok());
  EXPECT_EQ(fake_.max_unacknowledged(), 3);
  EXPECT_EQ(FirstCoordinates().size(), 21u);
}

TEST_F(AppenderTest, BytesInFlightAreBoundedToo) {
  options_.max_in_flight_bytes = 1;
  const auto appender = Open();
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(appender->Append(Block(i)).ok());
    EXPECT_EQ(appender->totals().points_acknowledged, static_cast<uint64_t>(i + 1));
  }
  EXPECT_EQ(fake_.max_unacknowledged(), 1);
  ASSERT_TRUE(appender->Finish().ok());
}

TEST_F(AppenderTest, ABrokenConnectionIsResumedWithoutLossOrDuplication) {
  for (const bool lose_acks : {false, true}) {
    fake_.RemoveHull("a");
    StreamScript first;
    first.break_after = 3;
    first.lose_acks = lose_acks;
    StreamScript second;
    second.break_after = 1;
    second.lose_acks = lose_acks;
    fake_.ScriptStreams({first, second});
    const auto appender = Open();
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(appender->Append(Block(i)).ok());
    const absl::Status finished = appender->Finish();
    ASSERT_TRUE(finished.ok()) << finished;
    EXPECT_THAT(FirstCoordinates(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
    EXPECT_EQ(appender->totals().reconnects, 2u);
    EXPECT_EQ(appender->totals().points_acknowledged, 10u);
    EXPECT_EQ(appender->totals().chunks_recovered, lose_acks ? 4u : 0u);
  }
}

TEST_F(AppenderTest, ARetryDelayFromTheServerIsHonored) {
  StreamScript script;
  script.break_after = 3;
  script.exhausted = true;
  script.retry_hint = std::chrono::milliseconds(7777);
  fake_.ScriptStreams({script});
  const auto appender = Open();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(appender->Append(Block(i)).ok());
  const absl::Status finished = appender->Finish();
  ASSERT_TRUE(finished.ok()) << finished;
  EXPECT_THAT(FirstCoordinates(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_EQ(appender->totals().reconnects, 1u);
  EXPECT_THAT(waits_, ElementsAre(std::chrono::milliseconds(7777)));
}

TEST_F(AppenderTest, ResourceExhaustedWithoutARetryDelayEndsTheAppend) {
  StreamScript script;
  script.break_after = 3;
  script.exhausted = true;
  fake_.ScriptStreams({script});
  const auto appender = Open();
  absl::Status status;
  for (int i = 0; i < 10 && status.ok(); ++i) status = appender->Append(Block(i));
  if (status.ok()) status = appender->Finish();
  EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
  EXPECT_TRUE(waits_.empty());
}

TEST_F(AppenderTest, AConnectionThatKeepsBreakingIsAbandoned) {
  const grpc::Status down(grpc::StatusCode::UNAVAILABLE, "down");
  StreamScript script;
  script.break_after = 1;
  fake_.ScriptStreams({script});
  const auto appender = Open();
  fake_.FailNext("AppendPoints", std::vector<grpc::Status>(10, down));
  absl::Status status;
  for (int i = 0; i < 100 && status.ok(); ++i) status = appender->Append(Block(i));
  if (status.ok()) status = appender->Finish();
  EXPECT_EQ(status, absl::UnavailableError("down"));
  EXPECT_EQ(appender->Append(Block(1)), status);
  EXPECT_EQ(appender->Finish(), status);
}

TEST_F(AppenderTest, ANewHullUnderTheSameNameIsNotContinued) {
  StreamScript script;
  script.break_after = 1;
  fake_.ScriptStreams({script});
  const auto appender = Open();
  before_reconnect_ = [this] {
    FakeHull other;
    other.create_revision = 77;
    fake_.PutHull("a", other);
  };
  absl::Status status;
  for (int i = 0; i < 5 && status.ok(); ++i) status = appender->Append(Block(i));
  if (status.ok()) status = appender->Finish();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(Text(status), HasSubstr("append all points again"));
  EXPECT_EQ(FirstCoordinates().size(), 0u);
}

TEST_F(AppenderTest, AVanishedHullIsNotRecreated) {
  StreamScript script;
  script.break_after = 1;
  fake_.ScriptStreams({script});
  const auto appender = Open();
  before_reconnect_ = [this] { fake_.RemoveHull("a"); };
  absl::Status status;
  for (int i = 0; i < 5 && status.ok(); ++i) status = appender->Append(Block(i));
  if (status.ok()) status = appender->Finish();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(Text(status), HasSubstr("was deleted while the connection was down"));
}

TEST_F(AppenderTest, ARefusedChunkIsReportedAndEarlierOnesRemain) {
  StreamScript script;
  script.refuse_sequence = 3;
  fake_.ScriptStreams({script});
  const auto appender = Open();
  absl::Status status;
  for (int i = 0; i < 5 && status.ok(); ++i) status = appender->Append(Block(i));
  if (status.ok()) status = appender->Finish();
  EXPECT_EQ(status, absl::InvalidArgumentError("sequence 3: points[0].x is NaN"));
  EXPECT_THAT(FirstCoordinates(), ElementsAre(0, 1));
  EXPECT_EQ(fake_.calls("AppendPoints"), 1);
}

TEST_F(AppenderTest, AServerThatAcknowledgesNothingCausesADeadlineError) {
  StreamScript script;
  script.hold_acks = true;
  fake_.ScriptStreams({script});
  const auto appender = Open(std::chrono::milliseconds(500));
  ASSERT_TRUE(appender->Append(Block(1)).ok());
  const absl::Status status = appender->Finish();
  EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
  fake_.Release();
}

TEST_F(AppenderTest, AServerThatDoesNotOpenTheStreamCausesADeadlineError) {
  fake_.Hang("AppendPoints");
  ClientOptions options;
  options.server = fake_.address();
  options.timeout = std::chrono::milliseconds(50);
  EXPECT_TRUE(absl::IsDeadlineExceeded(Client(options).OpenAppend("a", options_).status()));
}

TEST_F(AppenderTest, AMissingHullIsNotFound) {
  ClientOptions options;
  options.server = fake_.address();
  const absl::Status status = Client(options).OpenAppend("nope").status();
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
  EXPECT_EQ(ReasonOf(status), v1::ERROR_REASON_HULL_NOT_FOUND);
  EXPECT_EQ(MetadataOf(status, "hull_id"), "nope");
}

TEST_F(AppenderTest, DestructionWithoutFinishEndsTheStream) {
  auto appender = Open();
  ASSERT_TRUE(appender->Append(Block(1)).ok());
  appender = nullptr;
  // The fake's destructor would wait forever for an open stream.
}

}  // namespace appender_test
}  // namespace hulld
