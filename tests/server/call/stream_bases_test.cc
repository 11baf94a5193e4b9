// The bases of all streams, under minimal reactors controlled by a test.

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "server/call/call_stream.h"

namespace hulld::server {
namespace stream_bases_test {

using ::testing::ElementsAre;
using Batch = v1::BatchCheckCollisionsResponse;
using Mesh = v1::GetHullMeshResponse;

// Signals that the test may continue; shared with reactors that outlive it.
struct Signal {
  void Set() { promise.set_value(); }
  void Wait() { future.wait(); }
  std::promise<void> promise;
  std::shared_future<void> future = promise.get_future().share();
};

// Replies are numbered by first_pair.
class TestQueue : public QueuedStream<WriteReactor, Batch> {
 public:
  using Script = std::function<void(const std::shared_ptr<TestQueue>&)>;

  TestQueue(grpc::CallbackServerContext& context, Admission& admission, Script script,
            std::shared_ptr<Signal> gone)
      : QueuedStream(context, admission, Rpc::kBatchCheckCollisions),
        script_(std::move(script)),
        gone_(std::move(gone)) {}
  ~TestQueue() override { gone_->Set(); }

  void Reply(uint64_t number, size_t bytes = 0) {
    Locked([&] {
      Batch reply;
      reply.set_first_pair(number);
      Queue(std::move(reply), bytes);
    });
  }
  void SetEnd(const absl::Status& status) {
    Locked([&] { End(status); });
  }
  void SetWorking(bool working) {
    Locked([&] { working_ = working; });
  }
  void Do(const std::function<void()>& step) { Locked(step); }
  // From the next step on.
  void KeepWaiting(bool keeps) { keeps_waiting_ = keeps; }
  bool ShouldStop() { return call().ShouldStop(); }

  using QueuedStream::end;
  using QueuedStream::finished;
  using QueuedStream::GrowLastWaiting;
  using QueuedStream::LastWaiting;
  using QueuedStream::unsent_bytes;

 private:
  void Open() override { script_(std::static_pointer_cast<TestQueue>(shared_from_this())); }
  void StartWork() override {}
  bool IsWorking() const override { return working_; }
  bool ShouldDelayWrite() override { return keeps_waiting_; }

  const Script script_;
  const std::shared_ptr<Signal> gone_;
  bool working_ = false;
  std::atomic<bool> keeps_waiting_ = false;
};

// Makes `count` replies, and counts them.
class TestPull : public PulledStream<WriteReactor, Mesh> {
 public:
  TestPull(grpc::CallbackServerContext& context, Admission& admission, size_t count, size_t bytes,
           const absl::Status& end, std::atomic<size_t>& made)
      : PulledStream(context, admission, Rpc::kGetHullMesh),
        count_(count),
        bytes_(bytes),
        end_(end),
        made_(made) {}

 private:
  void Open() override { Make(); }
  void OnSent() override {
    reply().Clear();
    Make();
  }
  void Make() {
    if (made_ == count_) return FinishCall(end_);
    ++made_;
    reply().mutable_header()->mutable_hull()->set_hull_id(std::string(bytes_, 'x'));
    Send();
  }

  const size_t count_;
  const size_t bytes_;
  const absl::Status end_;
  std::atomic<size_t>& made_;
};

using Collisions =
    v1::CollisionService::WithRawCallbackMethod_BatchCheckCollisions<v1::CollisionService::Service>;
using Hulls = v1::HullService::WithRawCallbackMethod_GetHullMesh<v1::HullService::Service>;

class StreamBases : public ::testing::Test, public Collisions, public Hulls {
 protected:
  void SetUp() override {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(static_cast<Collisions*>(this));
    builder.RegisterService(static_cast<Hulls*>(this));
    server_ = builder.BuildAndStart();
    const auto channel = grpc::CreateChannel("127.0.0.1:" + std::to_string(port),
                                             grpc::InsecureChannelCredentials());
    collisions_ = v1::CollisionService::NewStub(channel);
    hulls_ = v1::HullService::NewStub(channel);
  }

  void TearDown() override {
    server_->Shutdown();
    EXPECT_TRUE(admission_.WaitIdle(std::chrono::steady_clock::time_point::max()));
  }

  WriteReactor* BatchCheckCollisions(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer*) override {
    return TestQueue::Launch(std::make_shared<TestQueue>(*context, admission_, script_, gone_));
  }

  WriteReactor* GetHullMesh(grpc::CallbackServerContext* context,
                            const grpc::ByteBuffer*) override {
    return TestPull::Launch(
        std::make_shared<TestPull>(*context, admission_, count_, bytes_, end_, made_));
  }

  // Returns the status of a call and the numbers of all its replies.
  grpc::Status Run(TestQueue::Script script, std::vector<uint64_t>* numbers) {
    script_ = std::move(script);
    grpc::ClientContext context;
    const auto reader = collisions_->BatchCheckCollisions(&context, {});
    Batch reply;
    while (reader->Read(&reply)) numbers->push_back(reply.first_pair());
    return reader->Finish();
  }

  Metrics metrics_;
  ConnectionTable connections_{1, 1};
  Admission admission_{Limits(), metrics_, connections_};
  TestQueue::Script script_;
  std::shared_ptr<Signal> gone_ = std::make_shared<Signal>();
  size_t count_ = 0;
  size_t bytes_ = 0;
  absl::Status end_;
  std::atomic<size_t> made_ = 0;
  std::unique_ptr<v1::CollisionService::Stub> collisions_;
  std::unique_ptr<v1::HullService::Stub> hulls_;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(StreamBases, AStatusSetDuringAWriteFollowsAllReplies) {
  std::vector<uint64_t> numbers;
  const grpc::Status status = Run(
      [](const std::shared_ptr<TestQueue>& stream) {
        for (uint64_t i = 1; i <= 5; ++i) stream->Reply(i);
        stream->SetEnd(absl::OkStatus());
        EXPECT_FALSE(stream->finished());
      },
      &numbers);
  EXPECT_TRUE(status.ok());
  EXPECT_THAT(numbers, ElementsAre(1, 2, 3, 4, 5));
}

TEST_F(StreamBases, AnErrorFollowsEarlierReplies) {
  std::vector<uint64_t> numbers;
  const grpc::Status status = Run(
      [](const std::shared_ptr<TestQueue>& stream) {
        stream->Reply(1);
        stream->Reply(2);
        stream->SetEnd(absl::InvalidArgumentError("the third is wrong"));
        stream->SetEnd(absl::OkStatus());  // the first status stands
      },
      &numbers);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "the third is wrong");
  EXPECT_THAT(numbers, ElementsAre(1, 2));
}

TEST_F(StreamBases, AStreamEndsOnlyWhenItsWorkIsOver) {
  const auto release = std::make_shared<Signal>();
  std::vector<uint64_t> numbers;
  std::thread worker;
  const grpc::Status status = Run(
      [&](const std::shared_ptr<TestQueue>& stream) {
        stream->SetWorking(true);
        stream->SetEnd(absl::OkStatus());
        worker = std::thread([stream] {
          stream->Do([&] { EXPECT_FALSE(stream->finished()); });
          stream->Reply(1);  // replies found in the interim are still sent
          stream->SetWorking(false);
        });
      },
      &numbers);
  worker.join();
  EXPECT_TRUE(status.ok());
  EXPECT_THAT(numbers, ElementsAre(1));
}

TEST_F(StreamBases, CancellingStopsTheWorkAndDropsQueuedReplies) {
  std::promise<std::shared_ptr<TestQueue>> opened;
  script_ = [&](const std::shared_ptr<TestQueue>& stream) {
    stream->SetWorking(true);
    opened.set_value(stream);
  };
  grpc::ClientContext context;
  const auto reader = collisions_->BatchCheckCollisions(&context, {});
  std::shared_ptr<TestQueue> stream = opened.get_future().get();
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  while (!stream->ShouldStop()) std::this_thread::yield();
  stream->Do([&] {
    ASSERT_TRUE(stream->end().has_value());
    EXPECT_EQ(stream->end()->code(), absl::StatusCode::kCancelled);
    EXPECT_FALSE(stream->finished());
    EXPECT_EQ(stream->unsent_bytes(), 0u);
  });
  EXPECT_EQ(admission_.running(), 1u);  // while it works
  stream->SetWorking(false);
  EXPECT_TRUE(stream->finished());
  stream.reset();
  gone_->Wait();
}

TEST_F(StreamBases, UnsentBytesIncludeQueuedAndWrittenReplies) {
  std::vector<uint64_t> numbers;
  const grpc::Status status = Run(
      [](const std::shared_ptr<TestQueue>& stream) {
        stream->Do([&] {
          EXPECT_EQ(stream->LastWaiting(), nullptr);
          EXPECT_EQ(stream->unsent_bytes(), 0u);
        });
        stream->Reply(1, 100);  // in flight
        stream->Reply(2, 20);
        stream->Do([&] {
          ASSERT_NE(stream->LastWaiting(), nullptr);
          stream->LastWaiting()->reply.set_first_pair(3);
          stream->GrowLastWaiting(5);
          EXPECT_EQ(stream->LastWaiting()->bytes, 25u);
          EXPECT_EQ(stream->unsent_bytes(), 125u);
        });
        stream->SetEnd(absl::OkStatus());
      },
      &numbers);
  EXPECT_TRUE(status.ok());
  EXPECT_THAT(numbers, ElementsAre(1, 3));
}

TEST_F(StreamBases, RepliesAreCombinedUntilOneFollowsOrTheStreamEnds) {
  std::vector<uint64_t> numbers;
  const grpc::Status status = Run(
      [](const std::shared_ptr<TestQueue>& stream) {
        stream->KeepWaiting(true);
        stream->Reply(1, 100);
        stream->Do([&] {
          ASSERT_NE(stream->LastWaiting(), nullptr);
          stream->LastWaiting()->reply.set_first_pair(2);
        });
        // Only the last one waits behind another.
        stream->Reply(3, 10);
        stream->Do([&] { EXPECT_EQ(stream->LastWaiting()->bytes, 10u); });
        stream->SetEnd(absl::OkStatus());
      },
      &numbers);
  EXPECT_TRUE(status.ok());
  EXPECT_THAT(numbers, ElementsAre(2, 3));
}

TEST_F(StreamBases, RepliesOfManyThreadsAllArrive) {
  constexpr uint64_t kThreads = 4;
  constexpr uint64_t kReplies = 200;
  std::vector<std::thread> threads;
  std::vector<uint64_t> numbers;
  const grpc::Status status = Run(
      [&](const std::shared_ptr<TestQueue>& stream) {
        const auto left = std::make_shared<std::atomic<uint64_t>>(kThreads);
        for (uint64_t t = 0; t < kThreads; ++t) {
          threads.emplace_back([stream, left, t] {
            for (uint64_t i = 0; i < kReplies; ++i) stream->Reply(t * kReplies + i);
            if (--*left == 0) stream->SetEnd(absl::OkStatus());
          });
        }
      },
      &numbers);
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(status.ok());
  ASSERT_EQ(numbers.size(), kThreads * kReplies);
  // In the order in which each thread queued them.
  std::vector<uint64_t> next(kThreads);
  for (const uint64_t number : numbers) {
    EXPECT_EQ(number % kReplies, next[number / kReplies]++);
  }
}

TEST_F(StreamBases, ARefusedCallIsNeverOpened) {
  admission_.BeginDrain();
  std::vector<uint64_t> numbers;
  const grpc::Status status =
      Run([](const std::shared_ptr<TestQueue>&) { ADD_FAILURE() << "opened"; }, &numbers);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  gone_->Wait();
}

TEST_F(StreamBases, PulledRepliesComeInTurnAndThenTheEnd) {
  count_ = 3;
  bytes_ = 1;
  end_ = absl::DataLossError("nothing more");
  grpc::ClientContext context;
  const auto reader = hulls_->GetHullMesh(&context, {});
  Mesh reply;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(reader->Read(&reply));
  EXPECT_FALSE(reader->Read(&reply));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(made_, 3u);
}

// 100 MB; gRPC's windows hold only a part.
TEST_F(StreamBases, PulledRepliesAreNotMadeAheadOfTheClient) {
  count_ = 1000;
  bytes_ = 100'000;
  grpc::ClientContext context;
  const auto reader = hulls_->GetHullMesh(&context, {});
  Mesh reply;
  ASSERT_TRUE(reader->Read(&reply));
  context.TryCancel();
  while (reader->Read(&reply)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(admission_.WaitIdle(std::chrono::steady_clock::time_point::max()));
  EXPECT_GT(made_, 0u);
  EXPECT_LT(made_, 1000u);
}

}  // namespace stream_bases_test
}  // namespace hulld::server
