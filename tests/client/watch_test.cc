// Watches across a restart of the server.

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/client.h"
#include "tests/client/collision_round.h"
#include "tests/server/harness/test_server.h"

namespace hulld {
namespace watch_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class Watches : public server::ServerTest {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::path(::testing::TempDir()) /
                 absl::StrCat("hulld_watch_", getpid(), "_", counter_++);
    std::filesystem::create_directories(directory_);
    config_ = TestConfig();
    config_.store = "rocksdb";
    config_.data_dir = directory_ / "data";
    config_.listen = absl::StrCat("unix:", (directory_ / "socket").string());
    Restart(config_);
    options_.server = server_->address();
    // The client waits after it loses the server, which gives another one time to start.
    options_.retry.wait = [this](std::chrono::milliseconds wait) {
      ++waits_;
      now_ += wait;
      if (server_ != nullptr || !comes_again_) return;
      Restart(config_);
      if (meanwhile_) meanwhile_();
    };
    client_ = std::make_unique<Client>(options_);
  }
  ~Watches() override {
    client_.reset();
    server_.reset();
    std::filesystem::remove_all(directory_);
  }
  // Sets a reconnect timeout of 2 s, and a clock that only the test and the client's waits advance.
  void UseOwnClock() {
    options_.timeout = std::chrono::seconds(2);
    options_.retry.now = [this] {
      ++clock_readings_;
      return now_;
    };
  }
  // Stops the server; the watch's wait starts the next one.
  void Lose(std::function<void()> meanwhile) {
    meanwhile_ = std::move(meanwhile);
    TearDown();
  }

  static std::string Text(const v1::CollisionEvent& event) {
    const std::string kind = v1::CollisionEventKind_Name(event.kind());
    return absl::StrCat(absl::StripPrefix(kind, "COLLISION_EVENT_KIND_"), " ", event.placement_a(),
                        " ", event.placement_b());
  }
  static std::vector<std::string> Events(const v1::WatchCollisionsResponse& round) {
    std::vector<std::string> texts;
    for (const v1::CollisionEvent& event : round.events()) texts.push_back(Text(event));
    return texts;
  }
  static v1::CollisionWatchUpdate MoveTo(uint32_t placement, double x) {
    v1::CollisionWatchUpdate update;
    update.add_placements(placement);
    for (const double number : {1., 0., 0., 0., x, 0., 0.}) update.add_poses(number);
    return update;
  }

  static inline int counter_ = 0;
  std::filesystem::path directory_;
  server::Config config_;
  ClientOptions options_;
  std::unique_ptr<Client> client_;
  std::function<void()> meanwhile_;
  // True if a lost server is restarted.
  bool comes_again_ = true;
  int waits_ = 0;
  Deadline now_;
  int clock_readings_ = 0;
};

TEST_F(Watches, SurviveARestartLikeEverySafeCall) {
  Put("a", server::Cube());
  int waits = 0;
  options_.retry.wait = [&](std::chrono::milliseconds) {
    if (++waits == 10) Restart(config_);
  };
  const Client client(options_);
  TearDown();
  const auto hull = client.GetHull("a");
  EXPECT_TRUE(hull.ok()) << hull.status();
  EXPECT_GE(waits, 10);
}

TEST_F(Watches, WatchesOfHullsResume) {
  Put("a", server::Cube());
  Put("b", server::Cube());
  const auto watch = client_->WatchHulls({});
  auto message = watch->Next();
  while (message.ok() && !message->synced()) message = watch->Next();
  ASSERT_TRUE(message.ok()) << message.status();
  Lose([this] { Put("c", server::Cube()); });
  std::vector<std::string> reported;
  do {
    message = watch->Next();
    ASSERT_TRUE(message.ok()) << message.status();
    EXPECT_FALSE(message->restarted());
    for (const v1::HullEvent& event : message->events()) reported.push_back(event.hull().hull_id());
  } while (!message->synced());
  // One event for its creation and one for its points, or one for both.
  EXPECT_THAT(reported, testing::AnyOf(ElementsAre("c"), ElementsAre("c", "c")));
  EXPECT_GT(waits_, 0);
}

// The reconnect timeout applies to a missing server, not to an idle one: it starts with the first
// failure after the connection, so the clock is unused in between.
TEST_F(Watches, LongQuietWatchesContinue) {
  UseOwnClock();
  const Client client(options_);
  Put("a", server::Cube());
  const auto hulls = client.WatchHulls({});
  auto hull_message = hulls->Next();
  while (hull_message.ok() && !hull_message->synced()) hull_message = hulls->Next();
  EXPECT_EQ(std::exchange(clock_readings_, 0), 1);
  now_ += std::chrono::hours(1);
  Lose([] {});
  hull_message = hulls->Next();
  EXPECT_TRUE(hull_message.ok()) << hull_message.status();
  EXPECT_GT(std::exchange(clock_readings_, 0), 0);

  v1::CollisionWatchOpen open;
  *open.add_placements() = server::PlacementOf("a", 0);
  *open.add_placements() = server::PlacementOf("a", 0.5);
  const auto pairs = client.WatchCollisions(open);
  EXPECT_THAT(Events(Round(*pairs)), ElementsAre("ENTER 0 1"));
  EXPECT_EQ(std::exchange(clock_readings_, 0), 1);
  now_ += std::chrono::hours(1);
  Lose([] {});
  const auto pair_message = pairs->Next();
  EXPECT_TRUE(pair_message.ok()) << pair_message.status();
  EXPECT_GT(clock_readings_, 0);
}

TEST_F(Watches, WatchesOfAnUnreachableServerEndAfterTheirTimeout) {
  UseOwnClock();
  const Client client(options_);
  Put("a", server::Cube());
  const auto hulls = client.WatchHulls({});
  v1::CollisionWatchOpen open;
  for (const double x : {0., 0.5}) *open.add_placements() = server::PlacementOf("a", x);
  const auto pairs = client.WatchCollisions(open);
  auto hull_message = hulls->Next();
  while (hull_message.ok() && !hull_message->synced()) hull_message = hulls->Next();
  EXPECT_THAT(Events(Round(*pairs)), ElementsAre("ENTER 0 1"));
  comes_again_ = false;
  TearDown();
  // Waits of 100, 200, 400 and 800 ms fit, another of 1600 does not.
  EXPECT_TRUE(absl::IsUnavailable(hulls->Next().status()));
  EXPECT_EQ(std::exchange(waits_, 0), 4);
  EXPECT_TRUE(absl::IsUnavailable(pairs->Next().status()));
  EXPECT_EQ(waits_, 4);
}

// Watches of a server that refuses each of them.
class RefusedWatches : public ::testing::Test {
 protected:
  RefusedWatches() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&hulls_);
    builder.RegisterService(&collisions_);
    server_ = builder.BuildAndStart();
    options_.server = absl::StrCat("127.0.0.1:", port);
  }

  // Opens a watch of each kind, and passes functions that call its Next and its Cancel.
  void ForEachKind(const std::function<void(const std::function<absl::Status()>&,
                                            const std::function<void()>&)>& run) {
    const Client client(options_);
    const auto hulls = client.WatchHulls({});
    run([&] { return hulls->Next().status(); }, [&] { hulls->Cancel(); });
    calls_ = 0;
    const auto pairs = client.WatchCollisions({});
    run([&] { return pairs->Next().status(); }, [&] { pairs->Cancel(); });
  }

  ClientOptions options_;
  std::atomic<int> calls_ = 0;

 private:
  struct Hulls final : v1::HullService::Service {
    explicit Hulls(std::atomic<int>& count) : calls(count) {}
    grpc::Status WatchHulls(grpc::ServerContext*, const v1::WatchHullsRequest*,
                            grpc::ServerWriter<v1::WatchHullsResponse>*) override {
      ++calls;
      return {grpc::StatusCode::UNAVAILABLE, "refused"};
    }
    std::atomic<int>& calls;
  };
  struct Collisions final : v1::CollisionService::Service {
    explicit Collisions(std::atomic<int>& count) : calls(count) {}
    grpc::Status WatchCollisions(grpc::ServerContext*,
                                 grpc::ServerReaderWriter<v1::WatchCollisionsResponse,
                                                          v1::WatchCollisionsRequest>*) override {
      ++calls;
      return {grpc::StatusCode::UNAVAILABLE, "refused"};
    }
    std::atomic<int>& calls;
  };

  Hulls hulls_{calls_};
  Collisions collisions_{calls_};
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(RefusedWatches, EndAfterTheirTimeoutIncludingTheFirstAttempt) {
  options_.timeout = std::chrono::seconds(5);
  // The first attempt takes 6 s.
  options_.retry.now = [this] { return Deadline(std::chrono::seconds(calls_ == 0 ? 0 : 6)); };
  options_.retry.wait = [](std::chrono::milliseconds) { ADD_FAILURE(); };
  ForEachKind([](const auto& next, const auto&) { EXPECT_TRUE(absl::IsUnavailable(next())); });
}

TEST_F(RefusedWatches, ACancelledWatchDoesNotWaitForItsRetry) {
  options_.timeout = std::chrono::hours(1000);
  options_.retry.initial_backoff = options_.retry.max_backoff = std::chrono::hours(10);
  ForEachKind([this](const auto& next, const auto& cancel) {
    auto ended = std::async(std::launch::async, next);
    while (calls_ == 0) std::this_thread::yield();
    cancel();
    EXPECT_TRUE(absl::IsCancelled(ended.get()));
  });
}

// Cubes of side 1 along x, as listed and as packed placements.
class CollisionWatches : public Watches, public ::testing::WithParamInterface<bool> {
 protected:
  void SetUp() override {
    Watches::SetUp();
    Put("cube", server::Cube());
    Put("grows", server::Cube());
    Put("goes", server::Cube());
  }
  static v1::CollisionWatchOpen OpenOf(const std::vector<std::pair<std::string, double>>& places) {
    v1::CollisionWatchOpen open;
    for (const auto& [hull, x] : places) {
      if (!GetParam()) {
        *open.add_placements() = server::PlacementOf(hull, x);
        continue;
      }
      v1::PackedPlacements& packed = *open.mutable_packed_placements();
      packed.add_hulls(static_cast<uint32_t>(packed.hull_ids_size()));
      packed.add_hull_ids(hull);
      for (const double number : {1., 0., 0., 0., x, 0., 0.}) packed.add_poses(number);
    }
    return open;
  }
};

TEST_P(CollisionWatches, ReportEachEventOnceAndEndedContacts) {
  // 0 and 1 overlap throughout; 2 and 3 touch, and will overlap; 4 and 5 overlap until 5 is
  // deleted; 6 and 7 overlap until 7 moves away.
  const auto watch = client_->WatchCollisions(OpenOf({{"cube", 0},
                                                      {"cube", 0.5},
                                                      {"grows", 10},
                                                      {"cube", 11},
                                                      {"cube", 20},
                                                      {"goes", 20.5},
                                                      {"cube", 30},
                                                      {"cube", 30.5},
                                                      {"cube", 50}}));
  EXPECT_THAT(Events(Round(*watch)),
              UnorderedElementsAre("ENTER 0 1", "TOUCH 2 3", "ENTER 4 5", "ENTER 6 7"));
  // An update is acknowledged even without a change.
  ASSERT_TRUE(watch->Update(MoveTo(8, 60)).ok());
  EXPECT_EQ(Round(*watch).update(), 1u);
  Lose([&] {
    server::Appender appender(*hulls_, "grows", "w");
    ASSERT_TRUE(appender.Append(1, {1.25, 0.5, 0.5}).has_value());
    ASSERT_TRUE(appender.Finish().ok());
    ASSERT_TRUE(Delete("goes").ok());
    ASSERT_TRUE(watch->Update(MoveTo(7, 40)).ok());
  });
  const v1::WatchCollisionsResponse after = Round(*watch);
  EXPECT_THAT(Events(after), UnorderedElementsAre("ENTER 2 3", "LOST 4 5", "EXIT 6 7"));
  EXPECT_EQ(after.update(), 2u);
  for (const v1::CollisionEvent& event : after.events()) {
    if (Text(event) != "EXIT 6 7") continue;
    EXPECT_EQ(event.relation(), v1::RELATION_SEPARATED);
    EXPECT_EQ(event.revision_a(), Get("cube").hull().revision());
    EXPECT_EQ(event.revision_b(), event.revision_a());
  }
  // After that, it answers as before.
  ASSERT_TRUE(watch->Update(MoveTo(7, 29.5)).ok());
  const v1::WatchCollisionsResponse last = Round(*watch);
  EXPECT_THAT(Events(last), ElementsAre("ENTER 6 7"));
  EXPECT_EQ(last.update(), 3u);
}

TEST_P(CollisionWatches, ReportPairsThatAreNoLongerNear) {
  v1::CollisionWatchOpen open = OpenOf({{"cube", 0}, {"cube", 1.5}, {"cube", 10}, {"cube", 10.5}});
  open.set_clearance(1);
  const auto watch = client_->WatchCollisions(open);
  EXPECT_THAT(Events(Round(*watch)), UnorderedElementsAre("NEAR 0 1", "ENTER 2 3"));
  Lose([&] {
    ASSERT_TRUE(watch->Update(MoveTo(1, 5)).ok());
    ASSERT_TRUE(watch->Update(MoveTo(3, 11.5)).ok());
  });
  const v1::WatchCollisionsResponse after = Round(*watch);
  EXPECT_THAT(Events(after), UnorderedElementsAre("FAR 0 1", "EXIT 2 3"));
  for (const v1::CollisionEvent& event : after.events()) {
    EXPECT_EQ(event.within_clearance(), event.placement_a() == 2);
  }
}

TEST_P(CollisionWatches, RefuseUpdatesThatNameNoPlacement) {
  const auto watch = client_->WatchCollisions(OpenOf({{"cube", 0}, {"cube", 9}}));
  EXPECT_THAT(std::string(watch->Update(MoveTo(2, 0)).message()),
              HasSubstr("placement 2 does not exist"));
  v1::CollisionWatchUpdate short_pose = MoveTo(1, 0);
  short_pose.mutable_poses()->RemoveLast();
  EXPECT_THAT(std::string(watch->Update(short_pose).message()), HasSubstr("needs 7"));
  EXPECT_THAT(Events(Round(*watch)), IsEmpty());
  watch->Cancel();
  EXPECT_TRUE(absl::IsCancelled(watch->Next().status()));
}

INSTANTIATE_TEST_SUITE_P(Placements, CollisionWatches, testing::Bool(), [](const auto& packed) {
  return packed.param ? std::string("packed") : std::string("one_by_one");
});

}  // namespace watch_test
}  // namespace hulld
