#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace append_points_test {

using ::testing::HasSubstr;

class AppendPoints : public ServerTest {
 protected:
  // Returns the status of a new stream of `writer` after these messages.
  grpc::Status Outcome(const std::vector<v1::AppendPointsRequest>& messages) {
    grpc::ClientContext context;
    auto stream = hulls_->AppendPoints(&context);
    for (const v1::AppendPointsRequest& message : messages) {
      if (!stream->Write(message)) break;
    }
    stream->WritesDone();
    v1::AppendPointsResponse response;
    while (stream->Read(&response)) {
    }
    return stream->Finish();
  }
};

TEST_F(AppendPoints, ChunksAreAckedWithCountsRevisionsAndDurability) {
  const v1::HullInfo created = Create("cube");
  Appender appender(*hulls_, "cube", "w");
  ASSERT_TRUE(appender.is_open());
  EXPECT_EQ(appender.opened().writer_id(), "w");
  EXPECT_EQ(appender.opened().last_sequence(), 0);
  EXPECT_EQ(appender.opened().hull().dimension(), -1);

  const auto first = appender.Append(1, Cube());
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->sequence(), 1);
  EXPECT_EQ(first->outcome(), v1::APPEND_OUTCOME_APPLIED);
  EXPECT_EQ(first->durability(), v1::DURABILITY_MEMORY);
  EXPECT_GT(first->hull_revision(), created.revision());
  EXPECT_EQ(first->header().revision(), first->hull_revision());
  EXPECT_EQ(first->vertex_count(), 8);
  EXPECT_EQ(first->counts().received(), 8);
  EXPECT_EQ(first->counts().outside(), 8);

  const auto second = appender.Append(2, {0.5, 0.5, 0.5, 0, 0, 0, 2, 2, 2});
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->counts().received(), 3);
  EXPECT_EQ(second->counts().inside(), 1);
  EXPECT_EQ(second->counts().duplicate(), 1);
  EXPECT_EQ(second->counts().outside(), 1);
  EXPECT_TRUE(appender.Finish().ok());

  const v1::GetHullResponse hull = Get("cube");
  EXPECT_EQ(hull.hull().revision(), second->hull_revision());
  EXPECT_EQ(hull.hull().create_revision(), created.create_revision());
  EXPECT_EQ(hull.hull().counts().received(), 11);
  EXPECT_EQ(hull.hull().counts().outside(), 9);
}

TEST_F(AppendPoints, AChunkThatChangesNoVertexRaisesNoRevision) {
  Put("cube", Cube());
  const v1::GetHullResponse before = Get("cube");
  Appender appender(*hulls_, "cube", "w");
  const auto inside = appender.Append(1, {0.5, 0.5, 0.5, 1, 1, 1});
  ASSERT_TRUE(inside.has_value());
  EXPECT_EQ(inside->hull_revision(), before.hull().revision());
  EXPECT_EQ(inside->header().revision(), before.header().revision());
  EXPECT_TRUE(appender.Append(2, {}).has_value());
  EXPECT_EQ(Get("cube").header().revision(), before.header().revision());
  EXPECT_EQ(Get("cube").hull().counts().received(), 10);
}

TEST_F(AppendPoints, FloatsAreWidenedExactly) {
  Create("float");
  v1::AppendPointsRequest chunk;
  chunk.mutable_chunk()->set_sequence(1);
  for (const float x : {0.1f, 0.2f, 0.3f}) {
    chunk.mutable_chunk()->mutable_points()->add_xyz_float(x);
  }
  ASSERT_TRUE(Outcome({OpenMessage("float", "w"), chunk}).ok());
  EXPECT_EQ(Get("float").box_min().x(), static_cast<double>(0.1f));
  EXPECT_EQ(Get("float").box_max().z(), static_cast<double>(0.3f));
}

TEST_F(AppendPoints, AReconnectedWriterResumesAfterItsLastSequence) {
  Create("h");
  {
    Appender appender(*hulls_, "h", "w");
    ASSERT_TRUE(appender.Append(1, {0, 0, 0}).has_value());
    ASSERT_TRUE(appender.Append(2, {1, 0, 0}).has_value());
    appender.Cancel();
  }
  Appender again(*hulls_, "h", "w");
  ASSERT_TRUE(again.is_open());
  EXPECT_EQ(again.opened().last_sequence(), 2);
  const auto resent = again.Append(2, {1, 0, 0});
  ASSERT_TRUE(resent.has_value());
  EXPECT_EQ(resent->outcome(), v1::APPEND_OUTCOME_ALREADY_APPLIED);
  EXPECT_EQ(resent->sequence(), 2);
  EXPECT_EQ(resent->counts().received(), 0);
  const auto next = again.Append(3, {0, 1, 0});
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->outcome(), v1::APPEND_OUTCOME_APPLIED);
  EXPECT_TRUE(again.Finish().ok());
  EXPECT_EQ(Get("h").hull().counts().received(), 3);

  Appender other(*hulls_, "h", "other");
  EXPECT_EQ(other.opened().last_sequence(), 0);
}

TEST_F(AppendPoints, AWriterWithoutANameGetsARandomOne) {
  Create("h");
  Appender one(*hulls_, "h", "");
  Appender two(*hulls_, "h", "");
  EXPECT_FALSE(one.opened().writer_id().empty());
  EXPECT_NE(one.opened().writer_id(), two.opened().writer_id());
}

TEST_F(AppendPoints, SequencesStartOverInANewIncarnation) {
  Put("h", Cube());
  ASSERT_TRUE(Delete("h").ok());
  Create("h");
  Appender appender(*hulls_, "h", "put");
  EXPECT_EQ(appender.opened().last_sequence(), 0);
}

TEST_F(AppendPoints, AGapNamesTheExpectedSequence) {
  Create("h");
  Appender appender(*hulls_, "h", "w");
  ASSERT_TRUE(appender.Append(1, Cube()).has_value());
  EXPECT_FALSE(appender.Append(3, {9, 9, 9}).has_value());
  const grpc::Status status = appender.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("chunk 3: the expected sequence is 2"));
  EXPECT_EQ(Get("h").hull().counts().received(), 8);
}

TEST_F(AppendPoints, ARefusedChunkChangesNothingAndEarlierOnesRemain) {
  Create("h");
  Coordinates bad = Cube(5);
  bad[3 * 6 + 1] = std::numeric_limits<double>::quiet_NaN();
  Appender appender(*hulls_, "h", "w");
  ASSERT_TRUE(appender.Append(1, Cube()).has_value());
  const v1::GetHullResponse before = Get("h");
  EXPECT_FALSE(appender.Append(2, bad).has_value());
  const grpc::Status status = appender.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("chunk 2: points[6].y is NaN"));
  const v1::GetHullResponse after = Get("h");
  EXPECT_EQ(after.DebugString(), before.DebugString());
  Appender again(*hulls_, "h", "w");
  EXPECT_EQ(again.opened().last_sequence(), 1);
}

TEST_F(AppendPoints, AcksOfEarlierChunksArriveBeforeTheError) {
  Create("h");
  grpc::ClientContext context;
  auto stream = hulls_->AppendPoints(&context);
  stream->Write(OpenMessage("h", "w"));
  for (uint64_t i = 1; i <= 20; ++i) {
    stream->Write(ChunkMessage(i, {static_cast<double>(i), 0, 0}));
  }
  stream->Write(ChunkMessage(99, {0, 0, 0}));
  v1::AppendPointsResponse response;
  uint64_t acked = 0;
  uint64_t received = 0;
  while (stream->Read(&response)) {
    acked = std::max(acked, response.ack().sequence());
    received += response.ack().counts().received();
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(acked, 20);
  EXPECT_EQ(received, 20);
}

TEST_F(AppendPoints, AClientThatReadsAcksOnlyAtTheEndIsServed) {
  Create("h");
  grpc::ClientContext context;
  auto stream = hulls_->AppendPoints(&context);
  ASSERT_TRUE(stream->Write(OpenMessage("h", "w")));
  constexpr uint64_t kChunks = 5000;
  for (uint64_t i = 1; i <= kChunks; ++i) {
    ASSERT_TRUE(stream->Write(ChunkMessage(i, {static_cast<double>(i), 0, 0})));
  }
  stream->WritesDone();
  v1::AppendPointsResponse response;
  uint64_t last = 0;
  uint64_t received = 0;
  while (stream->Read(&response)) {
    EXPECT_GE(response.ack().sequence(), last);
    last = response.ack().sequence();
    received += response.ack().counts().received();
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(last, kChunks);
  EXPECT_EQ(received, kChunks);
}

TEST_F(AppendPoints, IfRevisionIsCheckedJustBeforeApplying) {
  Create("h");
  Appender appender(*hulls_, "h", "w");
  const auto first = appender.Append(1, Cube(), appender.opened().hull().revision());
  ASSERT_TRUE(first.has_value());
  const auto second = appender.Append(2, {3, 3, 3}, first->hull_revision());
  ASSERT_TRUE(second.has_value());
  EXPECT_FALSE(appender.Append(3, {4, 4, 4}, first->hull_revision()).has_value());
  const grpc::Status status = appender.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_THAT(status.error_message(),
              HasSubstr(absl::StrCat("is at revision ", second->hull_revision())));
  EXPECT_EQ(Get("h").hull().revision(), second->hull_revision());
}

TEST_F(AppendPoints, IfRevisionZeroMeansThatThisStreamCreatedTheHull) {
  Appender creator(*hulls_, "new", "w", true);
  EXPECT_TRUE(creator.Append(1, Cube(), 0).has_value());
  EXPECT_FALSE(creator.Append(2, {3, 3, 3}, 0).has_value());
  EXPECT_EQ(creator.Finish().error_code(), grpc::StatusCode::ABORTED);

  Create("old");
  Appender appender(*hulls_, "old", "w", true);
  EXPECT_FALSE(appender.Append(1, Cube(), 0).has_value());
  EXPECT_EQ(appender.Finish().error_code(), grpc::StatusCode::ABORTED);
}

TEST_F(AppendPoints, DeletingTheHullEndsItsIdleStreams) {
  Create("h");
  Appender one(*hulls_, "h", "one");
  Appender two(*hulls_, "h", "two");
  Appender other(*hulls_, "other", "w", true);
  ASSERT_TRUE(one.Append(1, Cube()).has_value());
  ASSERT_TRUE(Delete("h").ok());
  EXPECT_FALSE(one.ReadAck().has_value());
  EXPECT_FALSE(two.ReadAck().has_value());
  const grpc::Status status = one.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("deleted"));
  EXPECT_EQ(two.Finish().error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_TRUE(other.Append(1, Cube()).has_value());
  EXPECT_TRUE(other.Finish().ok());
}

TEST_F(AppendPoints, MissingHullsAreNotFoundUnlessCreated) {
  EXPECT_EQ(Outcome({OpenMessage("none", "w")}).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_TRUE(Outcome({OpenMessage("none", "w", true)}).ok());
  EXPECT_EQ(Get("none").hull().dimension(), -1);
}

TEST_F(AppendPoints, MalformedMessagesGetAClearError) {
  Create("h");
  const auto expect = [&](const std::vector<v1::AppendPointsRequest>& messages,
                          const std::string& what) {
    const grpc::Status status = Outcome(messages);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << what;
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  };
  const auto open = OpenMessage("h", "w");
  expect({ChunkMessage(1, Cube())}, "the first message must be open");
  expect({open, open}, "open was sent twice");
  expect({v1::AppendPointsRequest()}, "set open or chunk");
  expect({OpenMessage("a//b", "w")}, "open.hull_id \"a//b\" has an empty segment");
  expect({OpenMessage("h", std::string(257, 'w'))}, "open.writer_id has 257");
  expect({open, ChunkMessage(0, Cube())}, "sequences start at 1");
  expect({open, ChunkMessage(1, {1, 2, 3, 4})}, "chunk 1: points.xyz has 4 numbers");
  v1::AppendPointsRequest both = ChunkMessage(1, {1, 2, 3});
  both.mutable_chunk()->mutable_points()->add_xyz_float(1);
  expect({open, both}, "chunk 1: points has both xyz and xyz_float");
}

TEST_F(AppendPoints, LimitsNameTheirFlags) {
  Config config = TestConfig();
  config.limits.max_points_per_chunk = 10;
  config.limits.max_vertices_per_hull = 12;
  config.limits.max_hulls = 1;
  Restart(config);
  Create("h");
  const auto expect = [&](const std::vector<v1::AppendPointsRequest>& messages,
                          const std::string& what) {
    const grpc::Status status = Outcome(messages);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << what;
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  };
  expect({OpenMessage("h", "w"), ChunkMessage(1, Coordinates(33, 1.0))},
         "message contains 11 points; the limit is 10 (--max-points-per-chunk)");
  expect({OpenMessage("other", "w", true)}, "the limit is 1 (--max-hulls)");
  const Coordinates sphere = Sphere(16);
  const Coordinates half(sphere.begin(), sphere.begin() + 24);
  const Coordinates rest(sphere.begin() + 24, sphere.end());
  expect({OpenMessage("h", "w"), ChunkMessage(1, half), ChunkMessage(2, rest)},
         "the limit is 12 (--max-vertices-per-hull)");
  EXPECT_EQ(Get("h").hull().vertex_count(), 8);
}

}  // namespace append_points_test
}  // namespace hulld::server
