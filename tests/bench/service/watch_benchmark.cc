// Latency of watch events, and the event rate of a constantly changing store.
//
//   watch_benchmark [PROGRAM]
//
// Starts its own hulld with an in-memory store. Rows of CSV, times in microseconds:
//
//   floor              a round trip of StreamCollisions with one pair: the cost of any message
//   one watcher        from the writer reading an append's ack to the watcher reading the event;
//                      0 if the event comes first
//   1000 watchers      likewise, for all of 1000 that watch one hull
//   flood              kFloodHulls hulls that change as fast as their writers can, with a watcher
//                      that reads and one that does not: changes and events per second, and the
//                      growth of the server's resident memory

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kAppends = 2000;
constexpr int kCrowdAppends = 50;
constexpr int kWatchers = 1000;
constexpr int kFloodHulls = 32;
constexpr int kFloodWindow = 64;
constexpr std::chrono::seconds kFloodTime(5);

double Microseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::micro>(duration).count();
}

std::shared_ptr<grpc::Channel> Connect(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

void Print(const char* name, std::vector<double> times) {
  std::sort(times.begin(), times.end());
  const auto at = [&](double p) {
    return times[std::min(times.size() - 1, static_cast<size_t>(p * double(times.size())))];
  };
  std::printf("%s,%zu,%.0f,%.0f,,,\n", name, times.size(), at(0.5), at(0.99));
  std::fflush(stdout);
}

// Appends to a hull that stays a segment: each point changes it, at the same cost.
class Writer {
 public:
  Writer(const std::string& address, const std::string& hull_id)
      : stub_(v1::HullService::NewStub(Connect(address))), stream_(stub_->AppendPoints(&context_)) {
    v1::AppendPointsRequest open;
    open.mutable_open()->set_hull_id(hull_id);
    open.mutable_open()->set_writer_id("w");
    open.mutable_open()->set_create_if_absent(true);
    v1::AppendPointsResponse opened;
    stream_->Write(open);
    stream_->Read(&opened);
  }
  ~Writer() {
    stream_->WritesDone();
    v1::AppendPointsResponse rest;
    while (stream_->Read(&rest)) {
    }
    Require(stream_->Finish(), "AppendPoints");
  }

  void Send() {
    v1::AppendPointsRequest chunk;
    chunk.mutable_chunk()->set_sequence(++sent_);
    for (const double x : {double(sent_), 0.0, 0.0}) {
      chunk.mutable_chunk()->mutable_points()->add_xyz(x);
    }
    stream_->Write(chunk);
  }
  // Returns the revision after the acknowledged change.
  uint64_t Receive() {
    v1::AppendPointsResponse response;
    stream_->Read(&response);
    received_ = response.ack().sequence();
    return response.ack().hull_revision();
  }
  uint64_t sent() const { return sent_; }
  uint64_t received() const { return received_; }

 private:
  std::unique_ptr<v1::HullService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AppendPointsRequest, v1::AppendPointsResponse>>
      stream_;
  uint64_t sent_ = 0;
  uint64_t received_ = 0;
};

// Arrival times of events by watch.
class Board {
 public:
  void Note(int watcher, uint64_t revision) {
    const auto now = Clock::now();
    const std::lock_guard lock(mutex_);
    if (revision < awaited_ || heard_[watcher]) return;
    heard_[watcher] = true;
    times_.push_back(now);
    if (times_.size() == heard_.size()) all_.notify_all();
  }
  void Expect(int watchers, uint64_t revision) {
    const std::lock_guard lock(mutex_);
    heard_.assign(watchers, false);
    times_.clear();
    awaited_ = revision;
  }
  std::vector<Clock::time_point> Await() {
    std::unique_lock lock(mutex_);
    all_.wait(lock, [this] { return times_.size() == heard_.size(); });
    return times_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable all_;
  uint64_t awaited_ = UINT64_MAX;
  std::vector<char> heard_;
  std::vector<Clock::time_point> times_;
};

// A watch of a hull, read by gRPC's threads.
class Watcher : public grpc::ClientReadReactor<v1::WatchHullsResponse> {
 public:
  Watcher(v1::HullService::Stub& stub, const std::string& hull_id, int number, Board& board)
      : number_(number), board_(board) {
    request_.set_hull_id(hull_id);
    stub.async()->WatchHulls(&context_, &request_, this);
    StartRead(&message_);
    StartCall();
  }
  ~Watcher() override {
    context_.TryCancel();
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return is_done_; });
  }

  void AwaitSynced() {
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return is_synced_ || is_done_; });
    if (!is_synced_) Require(status_, "WatchHulls");
  }

 private:
  void OnReadDone(bool ok) override {
    if (!ok) return;
    for (const v1::HullEvent& event : message_.events()) {
      board_.Note(number_, event.hull().revision());
    }
    if (message_.synced()) {
      const std::lock_guard lock(mutex_);
      is_synced_ = true;
      ended_.notify_all();
    }
    StartRead(&message_);
  }
  void OnDone(const grpc::Status& status) override {
    const std::lock_guard lock(mutex_);
    status_ = status;
    is_done_ = true;
    ended_.notify_all();
  }

  const int number_;
  Board& board_;
  v1::WatchHullsRequest request_;
  grpc::ClientContext context_;
  v1::WatchHullsResponse message_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_synced_ = false;
  bool is_done_ = false;
  grpc::Status status_;
};

void MeasureFloor(const std::string& address) {
  const auto hulls = v1::HullService::NewStub(Connect(address));
  MakeBallHull(*hulls, "floor", 64, 1);
  const auto stub = v1::CollisionService::NewStub(Connect(address));
  grpc::ClientContext context;
  const auto stream = stub->StreamCollisions(&context);
  v1::StreamCollisionsRequest request;
  for (int i = 0; i < 2; ++i) request.mutable_open()->add_placements()->set_hull_id("floor");
  for (const uint32_t i : {0, 1}) request.mutable_open()->add_pairs(i);
  v1::StreamCollisionsResponse response;
  std::vector<double> times;
  for (int i = 0; i < kAppends; ++i) {
    const auto sent = Clock::now();
    stream->Write(request);
    stream->Read(&response);
    if (i > 0) times.push_back(Microseconds(Clock::now() - sent));
    request.mutable_update()->clear_poses();
    request.mutable_update()->clear_placements();
    request.mutable_update()->add_placements(1);
    for (const double x : {1.0, 0.0, 0.0, 0.0, 3 + 1e-3 * i, 0.0, 0.0}) {
      request.mutable_update()->add_poses(x);
    }
  }
  Print("floor", std::move(times));
  stream->WritesDone();
  while (stream->Read(&response)) {
  }
  Require(stream->Finish(), "StreamCollisions");
}

void MeasureDelay(const std::string& address, const char* name, int watchers, int appends) {
  const std::string hull_id = "watched" + std::to_string(watchers);
  Writer writer(address, hull_id);
  Board board;
  const auto stub = v1::HullService::NewStub(Connect(address));
  std::vector<std::unique_ptr<Watcher>> crowd;
  for (int i = 0; i < watchers; ++i) {
    crowd.push_back(std::make_unique<Watcher>(*stub, hull_id, i, board));
  }
  for (const auto& watcher : crowd) watcher->AwaitSynced();
  std::vector<double> times;
  uint64_t revision = 0;
  for (int i = 0; i < appends; ++i) {
    board.Expect(watchers, revision + 1);
    writer.Send();
    revision = writer.Receive();
    const auto acknowledged = Clock::now();
    for (const Clock::time_point time : board.Await()) {
      times.push_back(std::max(0.0, Microseconds(time - acknowledged)));
    }
  }
  Print(name, std::move(times));
}

void MeasureFlood(const ChildServer& server) {
  const auto stub = v1::HullService::NewStub(Connect(server.address()));
  v1::WatchHullsRequest request;
  request.set_prefix("flood/");
  grpc::ClientContext idle_context;
  const auto idle = stub->WatchHulls(&idle_context, request);
  grpc::ClientContext context;
  const auto reader = stub->WatchHulls(&context, request);
  std::atomic<uint64_t> events = 0;
  std::thread reading([&] {
    v1::WatchHullsResponse message;
    while (reader->Read(&message)) events += message.events_size();
  });
  const double before = server.ResidentMebibytes();
  std::atomic<bool> ending = false;
  std::atomic<uint64_t> changes = 0;
  std::vector<std::thread> writers;
  for (int i = 0; i < kFloodHulls; ++i) {
    writers.emplace_back([&, i] {
      Writer writer(server.address(), "flood/" + std::to_string(i));
      while (!ending) {
        while (writer.sent() < writer.received() + kFloodWindow) writer.Send();
        writer.Receive();
      }
      while (writer.received() < writer.sent()) writer.Receive();
      changes += writer.received();
    });
  }
  const auto start = Clock::now();
  std::this_thread::sleep_for(kFloodTime);
  ending = true;
  for (std::thread& writer : writers) writer.join();
  const double seconds = Microseconds(Clock::now() - start) * 1e-6;
  const double grown = server.ResidentMebibytes() - before;
  std::printf("flood,%d,,,%.0f,%.0f,%.1f\n", kFloodHulls, static_cast<double>(changes) / seconds,
              static_cast<double>(events) / seconds, grown);
  context.TryCancel();
  idle_context.TryCancel();
  reading.join();
  reader->Finish();
  idle->Finish();
}

int Run(int argc, char** argv) {
  const ChildServer server({argc > 1 ? argv[1] : HULLD_PROGRAM, "--listen", "127.0.0.1:0",
                            "--store", "memory", "--max-streams-per-client", "2000",
                            "--max-calls-per-client", "4000", "--log-level", "info"});
  std::printf("case,samples,p50_us,p99_us,changes_per_s,events_per_s,grown_mib\n");
  MeasureFloor(server.address());
  MeasureDelay(server.address(), "one watcher", 1, kAppends);
  MeasureDelay(server.address(), "1000 watchers", kWatchers, kCrowdAppends);
  MeasureFlood(server);
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Run(argc, argv); }
