// Limits on calls: each refuses with an error that names its flag, and is counted.

#include <gmock/gmock.h>
#include <grpc/grpc.h>
#include <grpc/grpc_security.h>
#include <grpc/slice.h>
#include <gtest/gtest.h>
#include <prometheus/text_serializer.h>

#include <chrono>
#include <list>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "server/call/admission.h"
#include "server/contract/errors.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace limits_test {

using ::testing::HasSubstr;

using BatchReader = std::unique_ptr<grpc::ClientReader<v1::BatchCheckCollisionsResponse>>;

// Returns the value of a key in trailing metadata; empty if missing.
std::string Trailing(const grpc::ClientContext& context, const char* key) {
  const auto& metadata = context.GetServerTrailingMetadata();
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

class LimitsTest : public ServerTest {
 protected:
  uint64_t Hits(const std::string& limit) const {
    const std::string text = prometheus::TextSerializer().Serialize(server_->metrics().Collect());
    const std::string series = "hulld_limits_hit_total{limit=\"" + limit + "\"} ";
    const size_t at = text.find(series);
    return at == std::string::npos ? 0 : std::stoull(text.substr(at + series.size()));
  }

  void ExpectRefused(const grpc::Status& status, const std::string& limit) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("(--" + limit + ")"));
    EXPECT_THAT(status.error_details(), HasSubstr("google.rpc.QuotaFailure"));
    EXPECT_GE(Hits(limit), 1);
  }

  static void ExpectRetryHint(const grpc::ClientContext& context, const grpc::Status& status,
                              const std::string& milliseconds) {
    EXPECT_EQ(Trailing(context, "grpc-retry-pushback-ms"), milliseconds);
    EXPECT_THAT(status.error_details(), HasSubstr("google.rpc.RetryInfo"));
  }

  // A batch with hours of work, which runs until cancelled.
  v1::BatchCheckCollisionsRequest LongBatch() {
    v1::BatchCheckCollisionsRequest request;
    request.set_method(v1::METHOD_TEXTBOOK_SAT);
    *request.add_placements() = PlacementOf("ball");
    *request.add_placements() = PlacementOf("ball", 0.5);
    for (int i = 0; i < 100'000; ++i) {
      request.add_pairs(0);
      request.add_pairs(1);
    }
    return request;
  }

  // Starts the batch; it is running on return.
  BatchReader StartBatch(grpc::ClientContext* context,
                         const v1::BatchCheckCollisionsRequest& request) {
    BatchReader reader = collisions_->BatchCheckCollisions(context, request);
    v1::BatchCheckCollisionsResponse part;
    EXPECT_TRUE(reader->Read(&part));
    return reader;
  }

  // Drains the stream, which gRPC requires before it returns the status.
  static grpc::Status FinishBatch(grpc::ClientReader<v1::BatchCheckCollisionsResponse>& reader) {
    v1::BatchCheckCollisionsResponse part;
    while (reader.Read(&part)) {
    }
    return reader.Finish();
  }

  // Waits until no call is running.
  bool WaitIdle() { return server_->WaitIdle(std::chrono::minutes(5)); }

  grpc::Status GetHull(grpc::ClientContext* context) {
    v1::GetHullRequest request;
    v1::GetHullResponse response;
    request.set_hull_id("ball");
    return hulls_->GetHull(context, request, &response);
  }
};

TEST_F(LimitsTest, StatusShowsEveryLimitEvenWhenTheServerIsFull) {
  Config config = TestConfig();
  config.limits.max_calls = 1;
  Restart(config);
  Put("ball", Sphere(100));
  ASSERT_TRUE(WaitIdle());
  Appender idle(*hulls_, "ball", "w");
  ASSERT_TRUE(idle.is_open());
  grpc::ClientContext refused_context;
  const grpc::Status refused = GetHull(&refused_context);
  ExpectRefused(refused, "max-calls");
  ExpectRetryHint(refused_context, refused, "100");

  grpc::ClientContext context;
  v1::GetStatusResponse response;
  ASSERT_TRUE(status_->GetStatus(&context, {}, &response).ok());
  const v1::Limits& limits = response.limits();
  EXPECT_EQ(limits.max_calls(), 1);
  EXPECT_EQ(limits.max_waiting_calls(), 1024);
  EXPECT_EQ(limits.max_streams_per_client(), 256);
  EXPECT_EQ(limits.max_concurrent_batches(), 32);
  EXPECT_EQ(limits.max_calls_per_client(), 512);
  EXPECT_EQ(limits.max_batches_per_client(), 16);
  EXPECT_EQ(limits.request_memory_bytes(), 128 << 20);
  EXPECT_EQ(limits.max_placements(), 200'000);
  EXPECT_EQ(limits.max_points_per_hull(), uint64_t{1} << 53);
  EXPECT_EQ(limits.max_message_bytes(), 16 << 20);
  EXPECT_EQ(limits.max_request_time().seconds(), 300);

  EXPECT_TRUE(idle.Finish().ok());
  ASSERT_TRUE(WaitIdle());
  grpc::ClientContext again;
  EXPECT_TRUE(GetHull(&again).ok());
}

TEST_F(LimitsTest, StreamsPerClientAreLimitedAndReleased) {
  Config config = TestConfig();
  config.limits.max_streams_per_client = 2;
  Restart(config);
  Put("ball", Cube());
  ASSERT_TRUE(WaitIdle());
  Appender first(*hulls_, "ball", "first");
  Appender second(*hulls_, "ball", "second");
  EXPECT_TRUE(first.is_open());
  EXPECT_TRUE(second.is_open());
  Appender third(*hulls_, "ball", "third");
  EXPECT_FALSE(third.is_open());
  ExpectRefused(third.Finish(), "max-streams-per-client");
  grpc::ClientContext context;
  EXPECT_TRUE(GetHull(&context).ok());
  EXPECT_TRUE(first.Finish().ok());
  EXPECT_TRUE(second.Finish().ok());
  ASSERT_TRUE(WaitIdle());
  Appender fourth(*hulls_, "ball", "fourth");
  EXPECT_TRUE(fourth.is_open());
}

TEST_F(LimitsTest, TheLimitPerClientHoldsRegardlessOfFreeSlots) {
  Config config = TestConfig();
  config.limits.max_calls_per_client = 1;
  Restart(config);
  Put("ball", Cube());
  ASSERT_TRUE(WaitIdle());
  Appender open(*hulls_, "ball", "w");
  ASSERT_TRUE(open.is_open());
  grpc::ClientContext context;
  const grpc::Status refused = GetHull(&context);
  ExpectRefused(refused, "max-calls-per-client");
  ExpectRetryHint(context, refused, "100");
  EXPECT_TRUE(open.Finish().ok());
  ASSERT_TRUE(WaitIdle());
  grpc::ClientContext again;
  EXPECT_TRUE(GetHull(&again).ok());
}

// A textbook query that takes hours runs in slices. A similar one that takes milliseconds is
// answered meanwhile.
TEST_F(LimitsTest, ALongTextbookQueryDelaysNoOther) {
  Config config = TestConfig();
  config.limits.max_textbook_axes = uint64_t{1} << 40;
  Restart(config);
  Put("large", Sphere(20'000));
  Put("small", Sphere(150));
  const auto query = [](const std::string& hull_id) {
    v1::CheckCollisionRequest request;
    request.set_method(v1::METHOD_TEXTBOOK_SAT);
    *request.mutable_a() = PlacementOf(hull_id);
    *request.mutable_b() = PlacementOf(hull_id, 0.5);
    return request;
  };
  grpc::ClientContext long_context;
  grpc::Status long_status;
  std::thread long_query([&] {
    v1::CheckCollisionResponse response;
    long_status = collisions_->CheckCollision(&long_context, query("large"), &response);
  });
  const auto running = [this] {
    const std::string text = prometheus::TextSerializer().Serialize(server_->metrics().Collect());
    return text.find("hulld_requests_running{rpc=\"CheckCollision\"} 1") != std::string::npos;
  };
  // Bounded by the test's time limit only.
  while (!running()) std::this_thread::yield();
  grpc::ClientContext context;
  // Fails the test if it waits for the long one.
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(2));
  v1::CheckCollisionResponse response;
  const grpc::Status status = collisions_->CheckCollision(&context, query("small"), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.relation(), v1::RELATION_OVERLAPPING);
  long_context.TryCancel();
  long_query.join();
  // It was still running: it had not been answered, and could be cancelled.
  EXPECT_EQ(long_status.error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(WaitIdle());
}

TEST_F(LimitsTest, ExcessBatchesAreRefusedWithARetryDelay) {
  Config config = TestConfig();
  config.limits.max_concurrent_batches = 1;
  Restart(config);
  Put("ball", Sphere(100));
  grpc::ClientContext running_context;
  const BatchReader running = StartBatch(&running_context, LongBatch());

  grpc::ClientContext batch_context;
  const grpc::Status batch = collisions_->BatchCheckCollisions(&batch_context, {})->Finish();
  ExpectRefused(batch, "max-concurrent-batches");
  ExpectRetryHint(batch_context, batch, "1000");
  grpc::ClientContext scene_context;
  ExpectRefused(collisions_->FindCollisions(&scene_context, {})->Finish(),
                "max-concurrent-batches");
  EXPECT_EQ(Hits("max-concurrent-batches"), 2);
  // Single pairs continue.
  v1::CheckCollisionRequest pair;
  *pair.mutable_a() = PlacementOf("ball");
  *pair.mutable_b() = PlacementOf("ball", 0.5);
  EXPECT_EQ(Check(pair).relation(), v1::RELATION_OVERLAPPING);

  running_context.TryCancel();
  EXPECT_FALSE(FinishBatch(*running).ok());
  ASSERT_TRUE(WaitIdle());
  grpc::ClientContext next_context;
  EXPECT_TRUE(FinishBatch(*collisions_->BatchCheckCollisions(&next_context, {})).ok());
}

// The points built by a replacement count like the points of any hull.
TEST_F(LimitsTest, AReplacementUnderWayCountsAgainstTheMemoryLimit) {
  Config config = TestConfig();
  config.limits.memory_limit = 1 << 20;
  Restart(config);
  const auto cache_bytes = [this] {
    std::istringstream lines(prometheus::TextSerializer().Serialize(server_->metrics().Collect()));
    const std::string name = "hulld_cache_bytes ";
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(name)) return std::stod(line.substr(name.size()));
    }
    return -1.0;
  };
  grpc::ClientContext context;
  v1::ReplaceHullResponse response;
  const auto writer = hulls_->ReplaceHull(&context, &response);
  v1::ReplaceHullRequest request;
  request.mutable_open()->set_hull_id("big");
  request.mutable_open()->set_create_if_absent(true);
  ASSERT_TRUE(writer->Write(request));
  const Coordinates sphere = Sphere(10'000);
  request.mutable_points()->mutable_xyz()->Assign(sphere.begin(), sphere.end());
  ASSERT_TRUE(writer->Write(request));
  // Bounded by the test's time limit only.
  while (cache_bytes() < 1 << 20) std::this_thread::yield();
  Create("other");
  const auto append = [this] {
    Appender appender(*hulls_, "other", "w");
    appender.Append(1, Cube());
    return appender.Finish();
  };
  ExpectRefused(append(), "memory-limit");
  // The replacement itself is refused, too.
  writer->Write(request);
  ExpectRefused(writer->Finish(), "memory-limit");
  ASSERT_TRUE(WaitIdle());
  EXPECT_EQ(cache_bytes(), 0);
  EXPECT_TRUE(append().ok());
}

// A stream keeps its state of each pair throughout its lifetime.
TEST_F(LimitsTest, PairsOfAStreamCountAgainstTheMemoryLimit) {
  Config config = TestConfig();
  config.limits.memory_limit = 1 << 20;
  Restart(config);
  Put("cube", Cube());
  const auto answer_pairs = [this](int pairs) {
    grpc::ClientContext context;
    const auto stream = collisions_->StreamCollisions(&context);
    v1::StreamCollisionsRequest request;
    *request.mutable_open()->add_placements() = PlacementOf("cube");
    *request.mutable_open()->add_placements() = PlacementOf("cube", 9);
    for (int i = 0; i < pairs; ++i) {
      request.mutable_open()->add_pairs(0);
      request.mutable_open()->add_pairs(1);
    }
    stream->Write(request);
    stream->WritesDone();
    v1::StreamCollisionsResponse response;
    int answered = 0;
    while (stream->Read(&response)) answered += response.pairs_size();
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(answered, status.ok() ? pairs : 0);
    return status;
  };
  // A pair takes more than 64 bytes and less than 512.
  EXPECT_TRUE(answer_pairs(1000).ok());
  ExpectRefused(answer_pairs(1 << 14), "memory-limit");
  ASSERT_TRUE(WaitIdle());
  EXPECT_TRUE(answer_pairs(1000).ok());
}

TEST_F(LimitsTest, ARequestEndsWhenItsTimeIsUp) {
  Config config = TestConfig();
  config.limits.max_request_time = std::chrono::milliseconds(50);
  Restart(config);
  Put("ball", Sphere(100));
  grpc::ClientContext context;
  ExpectRefused(FinishBatch(*collisions_->BatchCheckCollisions(&context, LongBatch())),
                "max-request-time");
}

TEST_F(LimitsTest, AnUnreadCallLosesItsSlotAtItsDeadline) {
  Config config = TestConfig();
  config.limits.max_request_time = std::chrono::seconds(2);
  Restart(config);
  Put("cube", Cube());
  ASSERT_TRUE(WaitIdle());
  // About 72 MB, far more than fits in gRPC's windows.
  v1::BatchCheckCollisionsRequest request;
  request.mutable_wanted()->set_separation(true);
  request.mutable_wanted()->set_witness(true);
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("cube", 9);
  for (int i = 0; i < 1'000'000; ++i) {
    request.add_pairs(0);
    request.add_pairs(1);
  }
  grpc::ClientContext context;
  const BatchReader unread = StartBatch(&context, request);
  EXPECT_TRUE(WaitIdle());
  EXPECT_FALSE(FinishBatch(*unread).ok());
}

// Calls to gRPC itself that remain unanswered.
class UnansweredCalls {
 public:
  UnansweredCalls() {
    grpc_init();
    queue_ = grpc_completion_queue_create_for_next(nullptr);
    grpc_channel_credentials* const plain = grpc_insecure_credentials_create();
    channel_ = grpc_channel_create("127.0.0.1:1", plain, nullptr);
    grpc_channel_credentials_release(plain);
  }
  ~UnansweredCalls() {
    for (Started& call : calls_) {
      grpc_metadata_array_destroy(&call.metadata);
      grpc_slice_unref(call.details);
      grpc_call_unref(call.call);
    }
    grpc_channel_destroy(channel_);
    grpc_completion_queue_shutdown(queue_);
    grpc_completion_queue_next(queue_, gpr_inf_future(GPR_CLOCK_REALTIME), nullptr);
    grpc_completion_queue_destroy(queue_);
    grpc_shutdown();
  }

  grpc_call* Start() {
    Started& call = calls_.emplace_back();
    grpc_metadata_array_init(&call.metadata);
    call.call = grpc_channel_create_call(channel_, nullptr, GRPC_PROPAGATE_DEFAULTS, queue_,
                                         grpc_slice_from_static_string("/none"), nullptr,
                                         gpr_inf_future(GPR_CLOCK_REALTIME), nullptr);
    grpc_op end = {};
    end.op = GRPC_OP_RECV_STATUS_ON_CLIENT;
    end.data.recv_status_on_client = {&call.metadata, &call.status, &call.details, nullptr};
    grpc_call_start_batch(call.call, &end, 1, &call, nullptr);
    return call.call;
  }
  // Waits until any of them ends.
  grpc_status_code Next() {
    const grpc_event event =
        grpc_completion_queue_next(queue_, gpr_inf_future(GPR_CLOCK_REALTIME), nullptr);
    return static_cast<Started*>(event.tag)->status;
  }

 private:
  struct Started {
    grpc_call* call = nullptr;
    grpc_metadata_array metadata = {};
    grpc_status_code status = GRPC_STATUS_OK;
    grpc_slice details = grpc_empty_slice();
  };
  grpc_completion_queue* queue_ = nullptr;
  grpc_channel* channel_ = nullptr;
  std::list<Started> calls_;
};

TEST(AdmissionTest, EveryOverdueCallIsCancelledWhileACancelledOneStays) {
  Limits limits;
  limits.max_request_time = std::chrono::milliseconds(1);
  Metrics metrics;
  ConnectionTable connections(1, 1);
  Admission admission(limits, metrics, connections);
  UnansweredCalls calls;
  const auto admit = [&] {
    return std::make_unique<Admission::Ticket>(
        *admission.Admit({.rpc = Rpc::kBatchCheckCollisions, .client = "", .call = calls.Start()}));
  };
  std::unique_ptr<Admission::Ticket> first = admit();
  EXPECT_EQ(calls.Next(), GRPC_STATUS_CANCELLED);
  const std::unique_ptr<Admission::Ticket> second = admit();
  first = nullptr;
  const std::unique_ptr<Admission::Ticket> third = admit();
  EXPECT_EQ(calls.Next(), GRPC_STATUS_CANCELLED);
  EXPECT_EQ(calls.Next(), GRPC_STATUS_CANCELLED);
}

TEST_F(LimitsTest, PlacementsAndPointsPerHullAreBounded) {
  Config config = TestConfig();
  config.limits.max_placements = 2;
  config.limits.max_points_per_hull = 10;
  Restart(config);
  Put("ball", Cube());
  Appender appender(*hulls_, "ball", "w");
  ASSERT_TRUE(appender.Append(1, {0, 0, 0, 1, 1, 1}).has_value());
  EXPECT_FALSE(appender.Append(2, {0, 0, 0}).has_value());
  const grpc::Status points = appender.Finish();
  ExpectRefused(points, "max-points-per-hull");
  EXPECT_THAT(points.error_message(), HasSubstr("chunk 2: hull \"ball\" has received 10 points"));
  EXPECT_EQ(Get("ball").hull().counts().received(), 10);

  v1::BatchCheckCollisionsRequest batch;
  v1::FindCollisionsRequest scene;
  v1::StreamCollisionsRequest stream;
  for (int i = 0; i < 3; ++i) {
    *batch.add_placements() = PlacementOf("ball");
    *scene.add_placements() = PlacementOf("ball");
    *stream.mutable_open()->add_placements() = PlacementOf("ball");
  }
  grpc::ClientContext batch_context;
  ExpectRefused(collisions_->BatchCheckCollisions(&batch_context, batch)->Finish(),
                "max-placements");
  grpc::ClientContext scene_context;
  ExpectRefused(collisions_->FindCollisions(&scene_context, scene)->Finish(), "max-placements");
  grpc::ClientContext stream_context;
  const auto poses = collisions_->StreamCollisions(&stream_context);
  ASSERT_TRUE(poses->Write(stream));
  ExpectRefused(poses->Finish(), "max-placements");
  EXPECT_EQ(Hits("max-placements"), 3);
}

TEST_F(LimitsTest, LimitsOfSinglePairsInABatchAreCountedToo) {
  Config config = TestConfig();
  config.limits.max_textbook_axes = 1;
  Restart(config);
  Put("ball", Cube());
  grpc::ClientContext context;
  v1::BatchCheckCollisionsRequest request;
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  *request.add_placements() = PlacementOf("ball");
  *request.add_placements() = PlacementOf("ball", 0.5);
  request.add_pairs(0);
  request.add_pairs(1);
  const auto reader = collisions_->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  ASSERT_TRUE(reader->Read(&part));
  ASSERT_EQ(part.columns().pair_problems_size(), 1);
  EXPECT_THAT(part.columns().pair_problems(0).message(), HasSubstr("(--max-textbook-axes)"));
  EXPECT_TRUE(FinishBatch(*reader).ok());
  EXPECT_EQ(Hits("max-textbook-axes"), 1);
}

TEST(LimitError, KeepsItsLimitAndHintUnderAPrefix) {
  const absl::Status status =
      Prefixed("chunk 3: ", Overloaded("9 calls run", 9, "max-calls", std::chrono::seconds(2)));
  EXPECT_EQ(status.message(), "chunk 3: 9 calls run; the limit is 9 (--max-calls)");
  EXPECT_EQ(ExceededLimit(status), "max-calls");
  EXPECT_EQ(RetryAfter(status), std::chrono::milliseconds(2000));
  EXPECT_EQ(RetryAfter(LimitExceeded("9 hulls", 9, "max-hulls")), std::nullopt);
  EXPECT_EQ(ExceededLimit(absl::ResourceExhaustedError("other")), std::nullopt);
}

}  // namespace limits_test
}  // namespace hulld::server
