#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <thread>

#include "client/calls/grpc_status.h"
#include "client/watch/hull_watch.h"
#include "server/hulls/watch_event.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace watch_hulls_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// One WatchHulls call.
class Watch {
 public:
  Watch(v1::HullService::Stub& stub, const v1::WatchHullsRequest& request)
      : reader_(stub.WatchHulls(&context_, request)) {}
  ~Watch() {
    if (reader_ != nullptr) End();
  }

  bool Read(v1::WatchHullsResponse* message) { return reader_->Read(message); }
  // Returns the next message that is not a progress mark.
  v1::WatchHullsResponse Next() {
    v1::WatchHullsResponse message;
    while (reader_->Read(&message)) {
      if (message.events_size() > 0 || message.synced() || message.restarted()) break;
    }
    return message;
  }
  // Returns the events up to and including the message with `synced`.
  std::vector<std::string> ReadUntilSynced() {
    std::vector<std::string> texts;
    v1::WatchHullsResponse message;
    while (!message.synced() && reader_->Read(&message)) {
      if (message.restarted()) texts.push_back("restarted");
      for (const v1::HullEvent& event : message.events()) texts.push_back(Text(event));
    }
    EXPECT_TRUE(message.synced());
    last_ = message.header();
    return texts;
  }
  const v1::ResponseHeader& last() const { return last_; }
  grpc::Status Finish() {
    v1::WatchHullsResponse message;
    while (reader_->Read(&message)) {
    }
    const grpc::Status status = reader_->Finish();
    reader_.reset();
    return status;
  }
  grpc::Status End() {
    context_.TryCancel();
    return Finish();
  }

  static std::string Text(const v1::HullEvent& event) {
    return absl::StrCat(absl::StripPrefix(v1::HullEventKind_Name(event.kind()), "HULL_EVENT_KIND_"),
                        " ", event.hull().hull_id());
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchHullsResponse>> reader_;
  v1::ResponseHeader last_;
};

v1::WatchHullsRequest OfPrefix(const std::string& prefix) {
  v1::WatchHullsRequest request;
  request.set_prefix(prefix);
  return request;
}

v1::WatchHullsRequest OfHull(const std::string& hull_id) {
  v1::WatchHullsRequest request;
  request.set_hull_id(hull_id);
  return request;
}

class WatchHulls : public ServerTest {
 protected:
  grpc::Status Refused(const v1::WatchHullsRequest& request) {
    return Watch(*hulls_, request).Finish();
  }
  // gRPC reads ahead for its clients without a fixed limit; here 64 KiB.
  std::unique_ptr<v1::HullService::Stub> SlowReader() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
    return v1::HullService::NewStub(grpc::CreateCustomChannel(
        server_->address(), grpc::InsecureChannelCredentials(), arguments));
  }
};

// The box of a hull that is not in memory is read after the batch was taken. If the hull was
// replaced in between, "CHANGED", which means the same incarnation, would be sent with the new one.
TEST(WatchEvent, AnEventNeverDescribesALaterIncarnationThanItsKind) {
  const auto change_of = [](ChangeKind kind, uint64_t create_revision, uint64_t revision) {
    HullChange change;
    change.kind = kind;
    change.record.hull_id = "h";
    change.record.create_revision = create_revision;
    change.record.revision = revision;
    return change;
  };
  const Box box = {Vector(0, 0, 0), Vector(1, 1, 1)};
  for (const ChangeKind kind :
       {ChangeKind::kCreated, ChangeKind::kChanged, ChangeKind::kReplaced}) {
    const HullChange change = change_of(kind, 5, 6);
    EXPECT_FALSE(AtCurrentState(change, change_of(kind, 7, 7).record, box).has_value());
    const std::optional<HullChange> later =
        AtCurrentState(change, change_of(kind, 5, 8).record, box);
    ASSERT_TRUE(later.has_value());
    EXPECT_EQ(later->kind, kind);
    EXPECT_EQ(later->record.revision, 8);
    EXPECT_FALSE(later->box.IsEmpty());
  }
  // "PRESENT" holds for any incarnation.
  const std::optional<HullChange> present = AtCurrentState(
      change_of(ChangeKind::kPresent, 5, 6), change_of(ChangeKind::kPresent, 7, 7).record, box);
  ASSERT_TRUE(present.has_value());
  EXPECT_EQ(present->record.create_revision, 7);
}

TEST_F(WatchHulls, ReportsAHullWithItsCountsAndItsBox) {
  Create("empty");
  Put("cube", Cube(0, 2));
  Watch watch(*hulls_, {});
  const v1::WatchHullsResponse present = watch.Next();
  ASSERT_EQ(present.events_size(), 2);
  const v1::HullEvent& cube = present.events(0);
  EXPECT_EQ(cube.kind(), v1::HULL_EVENT_KIND_PRESENT);
  EXPECT_EQ(cube.hull().SerializeAsString(), Get("cube").hull().SerializeAsString());
  EXPECT_EQ(cube.box_min().x(), 0);
  EXPECT_EQ(cube.box_max().z(), 2);
  const v1::HullEvent& empty = present.events(1);
  EXPECT_EQ(empty.hull().SerializeAsString(), Get("empty").hull().SerializeAsString());
  EXPECT_FALSE(empty.has_box_min() || empty.has_box_max());
  EXPECT_EQ(present.header().revision(), 0);
  const v1::WatchHullsResponse synced = watch.Next();
  EXPECT_TRUE(synced.synced());
  EXPECT_EQ(synced.header().revision(), cube.hull().revision());

  Put("empty", {5, 6, 7});
  const v1::WatchHullsResponse changed = watch.Next();
  ASSERT_EQ(changed.events_size(), 1);
  EXPECT_EQ(Watch::Text(changed.events(0)), "CHANGED empty");
  EXPECT_EQ(changed.events(0).box_max().z(), 7);
  EXPECT_EQ(changed.header().revision(), changed.events(0).hull().revision());
  EXPECT_EQ(changed.header().store_id(), present.header().store_id());

  ASSERT_TRUE(Delete("empty").ok());
  const v1::WatchHullsResponse deleted = watch.Next();
  ASSERT_EQ(deleted.events_size(), 1);
  EXPECT_EQ(Watch::Text(deleted.events(0)), "DELETED empty");
  EXPECT_EQ(deleted.events(0).hull().revision(), deleted.header().revision());
  EXPECT_FALSE(deleted.events(0).has_box_min());
  EXPECT_EQ(watch.End().error_code(), grpc::CANCELLED);
}

TEST_F(WatchHulls, RefusesRequestsThatContradictThemselves) {
  v1::WatchHullsRequest both = OfPrefix("a");
  both.set_hull_id("a");
  EXPECT_EQ(Refused(both).error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_THAT(Refused(both).error_message(), HasSubstr("prefix and hull_id are both set"));
  EXPECT_THAT(Refused(OfHull("a//b")).error_message(), HasSubstr("empty segment"));
  EXPECT_EQ(Refused(OfPrefix(std::string(257, 'a'))).error_code(), grpc::INVALID_ARGUMENT);
  v1::WatchHullsRequest no_store;
  no_store.set_after_revision(3);
  EXPECT_EQ(Refused(no_store).error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_THAT(Refused(no_store).error_message(), HasSubstr("after_revision requires store_id"));
}

TEST_F(WatchHulls, ResumesAfterTheLastHeader) {
  Create("a");
  Create("b");
  Watch first(*hulls_, {});
  EXPECT_THAT(first.ReadUntilSynced(), ElementsAre("PRESENT a", "PRESENT b"));
  v1::WatchHullsRequest resume;
  resume.set_after_revision(first.last().revision());
  resume.set_store_id(first.last().store_id());
  first.End();
  ASSERT_TRUE(Delete("a").ok());
  Put("b", Cube());
  EXPECT_THAT(Watch(*hulls_, resume).ReadUntilSynced(), ElementsAre("DELETED a", "PRESENT b"));
  Restart(TestConfig());
  Create("c");
  EXPECT_THAT(Watch(*hulls_, resume).ReadUntilSynced(), ElementsAre("restarted", "PRESENT c"));
}

TEST_F(WatchHulls, EndsWhenTheServerDrains) {
  Watch waits(*hulls_, {});
  waits.ReadUntilSynced();
  server_->BeginDrain();
  const grpc::Status status = waits.Finish();
  EXPECT_EQ(status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(FromGrpcStatus(status)), v1::ERROR_REASON_DRAINING);
  EXPECT_TRUE(server_->WaitIdle(std::chrono::hours(1)));
}

TEST_F(WatchHulls, CountsAsAStream) {
  Config config = TestConfig();
  config.limits.max_streams_per_client = 2;
  Restart(config);
  Watch one(*hulls_, {});
  one.ReadUntilSynced();
  Watch two(*hulls_, OfHull("h"));
  two.ReadUntilSynced();
  const grpc::Status status = Refused({});
  EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("--max-streams-per-client"));
}

TEST_F(WatchHulls, EndsAtItsDeadline) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
  const auto reader = hulls_->WatchHulls(&context, {});
  v1::WatchHullsResponse message;
  while (reader->Read(&message)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::DEADLINE_EXCEEDED);
  ASSERT_TRUE(server_->WaitIdle(std::chrono::hours(1)));
}

// A client does not read while many hulls change. The changes are acknowledged nevertheless, and
// the client gets each hull once when it resumes reading.
TEST_F(WatchHulls, ASlowReaderReceivesTheLastStateOfEachHull) {
  const auto slow = SlowReader();
  Watch watch(*slow, {});
  watch.ReadUntilSynced();
  constexpr uint64_t kHulls = 50;
  constexpr uint64_t kRounds = 40;
  for (uint64_t h = 0; h < kHulls; ++h) {
    Appender appender(*hulls_, absl::StrCat(std::string(240, 'h'), h), "w", true);
    for (uint64_t i = 1; i <= kRounds; ++i) {
      ASSERT_TRUE(appender.Append(i, {double(i), double(i * i), double(h)}).has_value());
    }
  }
  std::map<std::string, uint64_t> received;
  size_t events = 0;
  while (received.size() < kHulls || received.begin()->second < kRounds) {
    const v1::WatchHullsResponse message = watch.Next();
    for (const v1::HullEvent& event : message.events()) {
      ++events;
      received[event.hull().hull_id()] = event.hull().counts().received();
    }
    const bool all = std::all_of(received.begin(), received.end(),
                                 [](const auto& hull) { return hull.second == kRounds; });
    if (all && received.size() == kHulls) break;
  }
  EXPECT_LT(events, kHulls * kRounds);
}

// The client does not read while more hulls are created than fit in one message.
TEST_F(WatchHulls, AReaderFarBehindReceivesPresentAfterSynced) {
  const auto slow = SlowReader();
  Watch watch(*slow, {});
  watch.ReadUntilSynced();
  constexpr int kHulls = 2000;
  for (int h = 0; h < kHulls; ++h) Create(absl::StrCat(std::string(240, 'h'), h));
  std::set<std::string> received;
  std::set<v1::HullEventKind> kinds;
  while (received.size() < kHulls) {
    const v1::WatchHullsResponse message = watch.Next();
    ASSERT_GT(message.events_size(), 0);
    EXPECT_FALSE(message.synced() || message.restarted());
    for (const v1::HullEvent& event : message.events()) {
      EXPECT_TRUE(received.insert(event.hull().hull_id()).second);
      kinds.insert(event.kind());
    }
  }
  EXPECT_THAT(kinds, ElementsAre(v1::HULL_EVENT_KIND_PRESENT, v1::HULL_EVENT_KIND_CREATED));
  Create("last");
  EXPECT_THAT(watch.Next().events(0).kind(), v1::HULL_EVENT_KIND_CREATED);
}

TEST_F(WatchHulls, AResumedWatchReceivesEachDeletedIdOnce) {
  Create("a");
  Create("b");
  Watch first(*hulls_, {});
  first.ReadUntilSynced();
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(Delete("a").ok());
    if (i < 2) Create("a");
  }
  ASSERT_TRUE(Delete("b").ok());
  Create("b");
  v1::WatchHullsRequest resumed;
  resumed.set_after_revision(first.last().revision());
  resumed.set_store_id(first.last().store_id());
  Watch second(*hulls_, resumed);
  EXPECT_THAT(second.ReadUntilSynced(), ElementsAre("DELETED a", "PRESENT b"));
}

// The state of the store according to the events of a watch.
class Mirror {
 public:
  // Revisions of the creation and of the last change of each hull.
  using State = std::map<std::string, std::pair<uint64_t, uint64_t>>;

  void Fold(const v1::WatchHullsResponse& message) {
    if (message.restarted()) {
      state_.clear();
      is_synced_ = false;
    }
    const uint64_t before = header_.revision();
    for (const v1::HullEvent& event : message.events()) FoldEvent(event, before);
    EXPECT_TRUE(message.restarted() || message.header().revision() >= header_.revision());
    header_ = message.header();
    is_synced_ = is_synced_ || message.synced();
  }
  // A new call begins.
  void Resume() { is_synced_ = false; }

  const State& state() const { return state_; }
  const v1::ResponseHeader& header() const { return header_; }
  bool is_synced() const { return is_synced_; }

 private:
  void FoldEvent(const v1::HullEvent& event, uint64_t before) {
    const v1::HullInfo& hull = event.hull();
    const auto known = state_.find(hull.hull_id());
    const std::string text = Watch::Text(event);
    if (event.kind() == v1::HULL_EVENT_KIND_DELETED) {
      if (known != state_.end()) {
        EXPECT_GT(hull.revision(), known->second.second) << text;
        state_.erase(known);
      }
      return;
    }
    if (is_synced_) {
      EXPECT_GT(hull.revision(), before) << text;
    }
    switch (event.kind()) {
      case v1::HULL_EVENT_KIND_CREATED:
        EXPECT_EQ(known, state_.end()) << text;
        break;
      case v1::HULL_EVENT_KIND_CHANGED:
        if (known == state_.end()) {
          ADD_FAILURE() << text;
        } else {
          EXPECT_EQ(known->second.first, hull.create_revision()) << text;
        }
        break;
      case v1::HULL_EVENT_KIND_REPLACED:
        if (known != state_.end()) {
          EXPECT_LT(known->second.first, hull.create_revision()) << text;
        }
        break;
      default:
        EXPECT_EQ(event.kind(), v1::HULL_EVENT_KIND_PRESENT);
    }
    state_[hull.hull_id()] = {hull.create_revision(), hull.revision()};
  }

  State state_;
  v1::ResponseHeader header_;
  bool is_synced_ = false;
};

// Makes random changes to its own hulls, so that it knows their histories.
class Writer {
 public:
  Writer(v1::HullService::Stub& stub, int number)
      : stub_(stub), name_(absl::StrCat("w", number, "/")), random_(number) {}

  void Run(int changes) {
    for (int i = 0; i < changes; ++i) Change(absl::StrCat(name_, random_() % 8));
  }
  // States of each hull by revision; {0, 0} after a deletion.
  using History = std::map<std::string, std::map<uint64_t, std::pair<uint64_t, uint64_t>>>;
  const History& history() const { return history_; }

 private:
  void Change(const std::string& id) {
    auto& history = history_[id];
    const bool is_there = !history.empty() && history.rbegin()->second.first > 0;
    const uint64_t what = random_() % 8;
    if (is_there && what == 0) {
      grpc::ClientContext context;
      v1::DeleteHullRequest request;
      v1::DeleteHullResponse response;
      request.set_hull_id(id);
      ASSERT_TRUE(stub_.DeleteHull(&context, request, &response).ok());
      history[response.header().revision()] = {0, 0};
    } else if (what == 1) {
      Replace(id);
    } else if (is_there || what < 5) {
      Append(id);
    } else {
      grpc::ClientContext context;
      v1::CreateHullRequest request;
      v1::CreateHullResponse response;
      request.set_hull_id(id);
      ASSERT_TRUE(stub_.CreateHull(&context, request, &response).ok());
      Note(response.hull());
    }
  }

  void Append(const std::string& id) {
    Appender appender(stub_, id, "", true);
    ASSERT_TRUE(appender.is_open());
    Note(appender.opened().hull());
    for (uint64_t i = 1; i <= 1 + random_() % 3; ++i) {
      ++size_;
      const std::optional<v1::AppendAck> ack = appender.Append(i, {size_, size_ * size_, 1});
      ASSERT_TRUE(ack.has_value());
      v1::HullInfo hull = appender.opened().hull();
      hull.set_revision(ack->hull_revision());
      Note(hull);
    }
    ASSERT_TRUE(appender.Finish().ok());
  }

  void Replace(const std::string& id) {
    grpc::ClientContext context;
    v1::ReplaceHullResponse response;
    const auto writer = stub_.ReplaceHull(&context, &response);
    v1::ReplaceHullRequest request;
    request.mutable_open()->set_hull_id(id);
    request.mutable_open()->set_create_if_absent(true);
    writer->Write(request);
    for (const double x : Cube()) request.mutable_points()->add_xyz(x);
    writer->Write(request);
    request.mutable_points()->Clear();
    writer->Write(request);
    writer->WritesDone();
    ASSERT_TRUE(writer->Finish().ok());
    Note(response.hull());
  }

  void Note(const v1::HullInfo& hull) {
    history_[hull.hull_id()][hull.revision()] = {hull.create_revision(), hull.revision()};
  }

  v1::HullService::Stub& stub_;
  const std::string name_;
  std::mt19937_64 random_;
  double size_ = 0;
  History history_;
};

// Reported states, with the revision of the header.
using Moments = std::vector<std::pair<uint64_t, Mirror::State>>;

// Checks each state against the histories at its revision. A hull that changed since may be
// reported at an earlier or a later version.
void ExpectTrue(const Moments& moments, const Writer::History& histories) {
  for (const auto& [revision, state] : moments) {
    for (const auto& [id, history] : histories) {
      auto next = history.upper_bound(revision);
      const auto at =
          next == history.begin() ? std::pair<uint64_t, uint64_t>() : std::prev(next)->second;
      const auto found = state.find(id);
      const auto reported = found == state.end() ? decltype(at)() : found->second;
      if (next == history.end()) {
        ASSERT_EQ(reported, at) << id << " at " << revision;
        continue;
      }
      // Superseded: a state that existed, no older than the last one reported.
      bool was_there = reported.first == 0;
      for (const auto& [changed_at, after] : history) was_there = was_there || after == reported;
      ASSERT_TRUE(was_there) << id << " at " << revision;
    }
  }
}

TEST_F(WatchHulls, EventsAddUpToTheStoreStateAfterAnyResume) {
  constexpr int kWriters = 3;
  constexpr int kChanges = 250;
  constexpr int kWatches = 3;
  std::vector<Writer> writers;
  writers.reserve(kWriters);
  for (int w = 0; w < kWriters; ++w) writers.emplace_back(*hulls_, w);
  std::vector<Mirror> mirrors(kWatches);
  std::vector<Moments> moments(kWatches);
  std::vector<std::thread> threads;
  threads.reserve(kWatches);
  for (int n = 0; n < kWatches; ++n) {
    threads.emplace_back([&, n] {
      std::mt19937_64 random(n);
      Mirror& mirror = mirrors[n];
      // The first call is never cut.
      while (true) {
        v1::WatchHullsRequest request;
        request.set_after_revision(mirror.header().revision());
        request.set_store_id(mirror.header().store_id());
        Watch watch(*hulls_, request);
        mirror.Resume();
        uint64_t messages = n == 0 ? std::numeric_limits<uint64_t>::max() : 1 + random() % 20;
        v1::WatchHullsResponse message;
        while (messages-- > 0) {
          ASSERT_TRUE(watch.Read(&message));
          mirror.Fold(message);
          if (mirror.is_synced())
            moments[n].emplace_back(mirror.header().revision(), mirror.state());
          // The hull that is created last.
          if (mirror.is_synced() && mirror.state().contains("end")) return;
        }
      }
    });
  }
  std::vector<std::thread> writing;
  writing.reserve(kWriters);
  for (Writer& writer : writers) writing.emplace_back([&] { writer.Run(kChanges); });
  for (std::thread& thread : writing) thread.join();
  Create("end");
  for (std::thread& thread : threads) thread.join();

  Writer::History histories;
  for (const Writer& writer : writers) {
    histories.insert(writer.history().begin(), writer.history().end());
  }
  Mirror::State now;
  v1::ListHullsRequest list;
  list.set_page_size(1000);
  v1::ListHullsResponse page;
  grpc::ClientContext context;
  ASSERT_TRUE(hulls_->ListHulls(&context, list, &page).ok());
  for (const v1::HullInfo& hull : page.hulls()) {
    now[hull.hull_id()] = {hull.create_revision(), hull.revision()};
  }
  for (int n = 0; n < kWatches; ++n) {
    EXPECT_EQ(mirrors[n].state(), now);
    ExpectTrue(moments[n], histories);
    EXPECT_GT(moments[n].size(), 20);
  }
}

// The client's watch resumes when the server comes back.
TEST_F(WatchHulls, TheClientContinuesAfterARestart) {
  Config config = TestConfig();
  config.listen = "unix:" + ::testing::TempDir() + absl::StrCat("watch_", getpid(), ".sock");
  Restart(config);
  Create("a");
  HullWatch watch(v1::HullService::NewStub(channel_), {}, RetryPolicy(), std::chrono::hours(1));
  absl::StatusOr<v1::WatchHullsResponse> message = watch.Next();
  ASSERT_TRUE(message.ok());
  while (message.ok() && !message->synced()) message = watch.Next();
  std::unique_ptr<v1::HullService::Stub> before = std::move(hulls_);
  Restart(config);
  Create("b");
  // Another store: the watch starts over.
  do {
    message = watch.Next();
    ASSERT_TRUE(message.ok()) << message.status();
  } while (!message->restarted());
  EXPECT_EQ(Watch::Text(message->events(0)), "PRESENT b");
  watch.Cancel();
  while (message.ok()) message = watch.Next();
  EXPECT_TRUE(absl::IsCancelled(message.status()));
}

}  // namespace watch_hulls_test
}  // namespace hulld::server
