// Several servers over one database: the cost and the delay of applying changes of peer servers.
#include <absl/strings/str_cat.h>

#include <functional>
#include <future>
#include <random>
#include <thread>

#include "tests/server/harness/captured_log.h"
#include "tests/server/store/postgres/postgres_fixture.h"

namespace hulld::server {
namespace postgres_follow_test {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using Server = std::unique_ptr<PostgresRegistry>;

constexpr std::chrono::hours kNever{1};
constexpr char kPoll[] = "SELECT batch FROM hulld.store";
// Waits that take this long have failed.
constexpr std::chrono::seconds kLong{60};

class PostgresFollow : public PostgresTest {
 protected:
  void SetUp() override {
    PostgresTest::SetUp();
    options_.shared = true;
  }

  // A server reads changes of its peers only when it is called.
  void FollowWhenCalled() {
    options_.notices = false;
    options_.poll_interval = options_.heartbeat = kNever;
  }
  // Starts a server that bypasses the proxy.
  Server StartPeer() {
    const PostgresOptions through_proxy = options_;
    options_.conninfo = cluster().Conninfo(database_, cluster().socket_directory());
    Server server = MakeRegistry();
    options_ = through_proxy;
    return server;
  }
  // The second server has read the hull, of points on a sphere, and answers from memory.
  void StartWithHull(int vertices) {
    Start();
    other_ = StartPeer();
    ASSERT_TRUE(other_->Put("h", SpherePoints(vertices)).ok());
    ASSERT_TRUE(hulls_->View("h").ok());
    ASSERT_EQ(hulls_->registry().Cache().loads, 1);
  }
  void EndAll() {
    other_ = nullptr;
    hulls_ = nullptr;
  }
  // Expects that a server serves the same "h" as a server that just started.
  void ExpectSameAsFreshServer(PostgresRegistry& server) {
    const Server fresh = StartPeer();
    const auto view = server.View("h");
    const auto expected = fresh->View("h");
    ASSERT_TRUE(view.ok() && expected.ok()) << view.status() << expected.status();
    EXPECT_EQ(view->record, expected->record);
    EXPECT_EQ(view->served->low(), expected->served->low());
    EXPECT_EQ(view->served->high(), expected->served->high());
    EXPECT_EQ(Canonical(server, *view), Canonical(*fresh, *expected));
  }
  // Empty if the hull does not exist.
  static std::vector<Vector> Canonical(PostgresRegistry& server, const HullView& view) {
    const auto hull = server.registry().reader().Canonical(view, {});
    if (!hull.ok()) {
      ADD_FAILURE() << hull.status();
      return {};
    }
    return {(*hull)->vertices().begin(), (*hull)->vertices().end()};
  }

  Server other_;
};

// Returns a point outside the unit sphere, farther out for each i, so that all remain vertices.
Vector PointOutside(int i) {
  const double angle = 0.1 * i;
  return (1.1 + 0.001 * i) * Vector(std::cos(angle), std::sin(angle), 0.01 * i);
}

TEST_F(PostgresFollow, TheCostOfPeerChangesFollowsTheirSize) {
  FollowWhenCalled();
  constexpr int kAppends = 20;
  uint64_t bytes_of_the_smallest = 0;
  for (const int vertices : {500, 5000, 20'000}) {
    EndAll();
    database_ = cluster().MakeDatabase();
    options_.conninfo = cluster().Conninfo(database_, proxy_->directory());
    StartWithHull(vertices);
    const uint64_t before = proxy_->answered_bytes();
    for (int i = 0; i < kAppends; ++i) {
      ASSERT_TRUE(other_->Put("h", {PointOutside(i)}).ok());
      const auto view = hulls_->View("h");
      ASSERT_TRUE(view.ok()) << view.status();
      EXPECT_EQ(view->record.counts.received, vertices + i + 1);
      EXPECT_EQ(view->served->query_hull().point_count(), vertices + i + 1);
    }
    const uint64_t bytes = proxy_->answered_bytes() - before;
    EXPECT_EQ(hulls_->registry().Cache().loads, 1);
    EXPECT_EQ(hulls_->registry().Cache().grown, kAppends);
    if (bytes_of_the_smallest == 0) bytes_of_the_smallest = bytes;
    // The messages are the same, and numbers have a fixed size.
    EXPECT_EQ(bytes, bytes_of_the_smallest) << vertices << " vertices";
    EXPECT_LT(bytes, kAppends * 2048);
    ExpectSameAsFreshServer(*hulls_);
  }
}

// Covers points that absorb vertices, inside points, several batches per read, and a reader that
// holds an old snapshot.
TEST_F(PostgresFollow, AGrownHullEqualsOneReadAgain) {
  FollowWhenCalled();
  StartWithHull(300);
  const HullView first = *hulls_->View("h");
  const std::vector<Vector> first_vertices = Canonical(*hulls_, first);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 30; ++round) {
    for (int batch = 0; batch < 1 + round % 3; ++batch) {
      std::vector<Vector> points;
      for (int i = 0; i < 1 + round % 5; ++i) {
        points.emplace_back(normal(random), normal(random), normal(random));
      }
      ASSERT_TRUE(other_->Put("h", points).ok());
    }
    const auto view = hulls_->View("h");
    ASSERT_TRUE(view.ok()) << view.status();
    EXPECT_EQ(view->record, other_->View("h")->record);
    if (round % 10 == 9) ExpectSameAsFreshServer(*hulls_);
  }
  EXPECT_EQ(hulls_->registry().Cache().loads, 1);
  EXPECT_GT(hulls_->registry().Cache().grown, 10);
  EXPECT_EQ(hulls_->registry().Sizes().vertex_count, hulls_->View("h")->record.vertex_count);
  EXPECT_THAT(Canonical(*hulls_, first), ElementsAreArray(first_vertices));
  EXPECT_EQ(first.served->query_hull().point_count(), 300);
}

// Both servers append alternately: each keeps its builder and adds the peer's points to it.
TEST_F(PostgresFollow, AnAppendingServerContinuesFromPeerChanges) {
  FollowWhenCalled();
  StartWithHull(1000);
  const auto here = hulls_->Open("h", "here");
  const auto there = other_->Open("h", "there");
  ASSERT_TRUE(here.ok() && there.ok());
  uint64_t outside = 0;
  for (int i = 0; i < 20; ++i) {
    const auto added = other_->Append(there->session, i + 1, {PointOutside(2 * i)});
    ASSERT_TRUE(added.ok()) << added.status();
    // A server that applies peer changes before it builds has no conflict.
    ASSERT_TRUE(hulls_->View("h").ok());
    const auto result = hulls_->Append(here->session, i + 1, {PointOutside(2 * i + 1)});
    ASSERT_TRUE(result.ok()) << result.status();
    outside += result->counts.outside;
  }
  EXPECT_EQ(outside, 20);
  EXPECT_EQ(hulls_->registry().Cache().loads, 1);
  EXPECT_EQ(hulls_->registry().Cache().grown, 20);
  ExpectSameAsFreshServer(*hulls_);
  ExpectSameAsFreshServer(*other_);
}

// Both servers append concurrently, so that chunks being built or in flight conflict and are built
// again.
TEST_F(PostgresFollow, ConflictingChunksInFlightAreBuiltAgain) {
  StartWithHull(1000);
  constexpr uint64_t kChunks = 40;
  std::vector<std::thread> writers;
  for (PostgresRegistry* server : {hulls_.get(), other_.get()}) {
    writers.emplace_back([&, server] {
      const bool is_here = server == hulls_.get();
      const auto opened = server->Open("h", is_here ? "here" : "there");
      ASSERT_TRUE(opened.ok()) << opened.status();
      std::vector<std::future<absl::StatusOr<ChunkResult>>> results;
      for (uint64_t i = 0; i < kChunks; ++i) {
        const auto done = std::make_shared<std::promise<absl::StatusOr<ChunkResult>>>();
        results.push_back(done->get_future());
        server->registry().changes().Append(
            opened->session,
            {i + 1, {PointOutside(static_cast<int>(2 * i + is_here))}, std::nullopt}, {}, {},
            [done](absl::StatusOr<ChunkResult> result) { done->set_value(std::move(result)); });
      }
      for (auto& result : results) {
        const auto chunk = result.get();
        EXPECT_TRUE(chunk.ok()) << chunk.status();
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(hulls_->View("h")->record.counts.outside, 1000 + 2 * kChunks);
  ExpectSameAsFreshServer(*hulls_);
  ExpectSameAsFreshServer(*other_);
}

TEST_F(PostgresFollow, AHullWithANewBaseIsReadAgain) {
  FollowWhenCalled();
  StartWithHull(1000);
  // Larger than its base.
  ASSERT_TRUE(other_->Put("h", SpherePoints(3500, 2)).ok());
  ASSERT_EQ(RunSql("SELECT count(*) FROM hulld.deltas").front(), "0");
  ASSERT_TRUE(hulls_->View("h").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, 2);
  EXPECT_EQ(hulls_->registry().Cache().grown, 0);
  ExpectSameAsFreshServer(*hulls_);
}

TEST_F(PostgresFollow, AHullThatGrewMuchIsReadAgain) {
  FollowWhenCalled();
  StartWithHull(20'000);
  ASSERT_TRUE(other_->Put("h", SpherePoints(4097, 2)).ok());
  ASSERT_EQ(RunSql("SELECT count(*) FROM hulld.deltas").front(), "1");
  ASSERT_TRUE(hulls_->View("h").ok());
  EXPECT_EQ(hulls_->registry().Cache().loads, 2);
  EXPECT_EQ(hulls_->registry().Cache().grown, 0);
}

// Every caller gets the error, as without deltas.
TEST_F(PostgresFollow, DamagedDeltasAreDetected) {
  FollowWhenCalled();
  StartWithHull(1000);
  ASSERT_TRUE(other_->Put("h", {PointOutside(0)}).ok());
  RunSql("UPDATE hulld.deltas SET vertices = set_byte(vertices, 0, get_byte(vertices, 0) # 1)");
  EXPECT_TRUE(absl::IsDataLoss(hulls_->View("h").status()));
  EXPECT_EQ(hulls_->registry().Cache().grown, 0);
}

// Points added by a peer server do not survive the deletion of the hull.
TEST_F(PostgresFollow, AHullThatGrewAndWasDeletedIsGone) {
  FollowWhenCalled();
  StartWithHull(500);
  ASSERT_TRUE(other_->Put("h", {PointOutside(0)}).ok());
  ASSERT_TRUE(hulls_->View("h").ok());
  ASSERT_TRUE(other_->Put("h", {PointOutside(1)}).ok());
  ASSERT_TRUE(other_->Delete("h").ok());
  ASSERT_TRUE(other_->Put("h", CubeCorners()).ok());
  EXPECT_EQ(hulls_->View("h")->record.vertex_count, 8);
  ExpectSameAsFreshServer(*hulls_);
}

// The memory for changes that are not yet applied is bounded.
TEST_F(PostgresFollow, AServerThatLagsTooFarBehindStops) {
  FollowWhenCalled();
  Start();
  const auto change = [&](int count) {
    RunSql(absl::StrCat("UPDATE hulld.store SET batch = batch + 1, revision = revision + ", count,
                        "; INSERT INTO hulld.changes SELECT batch, 'h' || n, revision - ", count,
                        " + n, revision - ", count, " + n FROM hulld.store, generate_series(1, ",
                        count, ") n"));
  };
  bool ended = false;
  hulls_->store().OnEnded([&] { ended = true; });
  change(1 << 17);
  EXPECT_TRUE(hulls_->registry().peers().AwaitPeers({}).ok());
  EXPECT_EQ(hulls_->registry().Sizes().store_revision, 1 << 17);
  EXPECT_FALSE(ended);
  change((1 << 17) + 1);
  EXPECT_TRUE(absl::IsUnavailable(hulls_->registry().peers().AwaitPeers({})));
  EXPECT_TRUE(ended);
}

// Waits for the events of a watch of all hulls.
class Watcher {
 public:
  explicit Watcher(Registry& registry) : registry_(registry) {
    watch_ = *registry.feed().Open({.lists_existing = false}, {}, [this] {
      const std::lock_guard lock(mutex_);
      is_ready_ = true;
      ready_.notify_all();
    });
  }
  ~Watcher() { registry_.feed().Close(watch_); }

  // Returns true when an event for this hull arrives; false after kLong.
  bool Reports(const std::string& id) {
    while (true) {
      const auto batch = registry_.feed().Next(watch_);
      if (!batch.ok()) return false;
      for (const HullChange& change : batch->changes) {
        if (change.record.hull_id == id) return true;
      }
      if (!batch->waits) continue;
      std::unique_lock lock(mutex_);
      if (!ready_.wait_for(lock, kLong, [this] { return is_ready_; })) return false;
      is_ready_ = false;
    }
  }

 private:
  Registry& registry_;
  std::shared_ptr<Watch> watch_;
  std::mutex mutex_;
  std::condition_variable ready_;
  bool is_ready_ = false;
};

// Returns true when the condition becomes true; false after kLong.
bool BecomesTrue(const std::function<bool()>& what) {
  const auto end = std::chrono::steady_clock::now() + kLong;
  while (!what()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::yield();
  }
  return true;
}

// No server polls.
TEST_F(PostgresFollow, ANoticeOfABatchTriggersAReadImmediately) {
  options_.poll_interval = options_.heartbeat = kNever;
  Start();
  const Server other = StartPeer();
  Watcher here(hulls_->registry());
  Watcher there(other->registry());
  for (int i = 0; i < 20; ++i) {
    const std::string id = absl::StrCat("h", i);
    ASSERT_TRUE((i % 2 == 0 ? other : hulls_)->Create(id).ok());
    ASSERT_TRUE(here.Reports(id)) << i;
    ASSERT_TRUE(there.Reports(id)) << i;
  }
  EXPECT_EQ(proxy_->QueryCount(kPoll), 1);
}

TEST_F(PostgresFollow, WithoutNoticesServersPoll) {
  options_.notices = false;
  options_.poll_interval = std::chrono::milliseconds(10);
  Start();
  const Server other = StartPeer();
  Watcher watcher(hulls_->registry());
  ASSERT_TRUE(other->Create("h").ok());
  EXPECT_TRUE(watcher.Reports("h"));
}

// The listening session reconnects by itself.
TEST_F(PostgresFollow, ALostListeningSessionIsReopened) {
  const CapturedLog log;
  options_.poll_interval = options_.heartbeat = std::chrono::milliseconds(20);
  Start();
  other_ = StartPeer();
  {
    Watcher watcher(hulls_->registry());
    for (int i = 1; i <= 3; ++i) {
      const int listened = proxy_->QueryCount("LISTEN hulld_batches");
      EXPECT_GE(listened, i);
      proxy_->CutListeners();
      const std::string id = absl::StrCat("h", i);
      ASSERT_TRUE(other_->Create(id).ok());
      EXPECT_TRUE(watcher.Reports(id));
      ASSERT_TRUE(
          BecomesTrue([&] { return proxy_->QueryCount("LISTEN hulld_batches") > listened; }));
    }
  }
  EndAll();
  EXPECT_THAT(log.text(),
              HasSubstr("lost the session that receives commit notices of peer servers"));
  EXPECT_THAT(log.text(), HasSubstr("the server polls it every 20 ms"));
}

// The connection stays open but no notice arrives: the heartbeat finds the missed batch, and the
// server polls more often until notices arrive again.
TEST_F(PostgresFollow, AServerWithoutNoticesPollsMoreOften) {
  const CapturedLog log;
  options_.poll_interval = std::chrono::milliseconds(5);
  options_.heartbeat = std::chrono::milliseconds(500);
  Start();
  other_ = StartPeer();
  auto watcher = std::make_unique<Watcher>(hulls_->registry());
  const auto polls = [&] { return proxy_->QueryCount(kPoll); };
  const auto heartbeats = [&] { return proxy_->QueryCount("SELECT owner FROM hulld.store"); };
  ASSERT_TRUE(other_->Create("heard").ok());
  ASSERT_TRUE(watcher->Reports("heard"));
  proxy_->WithholdNotices(true);
  ASSERT_TRUE(other_->Create("unheard").ok());
  EXPECT_TRUE(watcher->Reports("unheard"));
  const int heartbeats_then = heartbeats();
  EXPECT_TRUE(BecomesTrue([&] { return heartbeats() > heartbeats_then + 3; }));
  EXPECT_GT(polls(), 3 * heartbeats());
  proxy_->WithholdNotices(false);
  ASSERT_TRUE(other_->Create("heard again").ok());
  EXPECT_TRUE(watcher->Reports("heard again"));
  // Two heartbeats cause two polls, and one poll may already have been running.
  EXPECT_TRUE(BecomesTrue([&] {
    const int polls_before = polls();
    const int heartbeats_before = heartbeats();
    return BecomesTrue([&] { return heartbeats() >= heartbeats_before + 2; }) &&
           polls() - polls_before <= 3;
  }));
  watcher = nullptr;
  EndAll();
  EXPECT_THAT(log.text(), HasSubstr("no commit notices are arriving"));
}

// The database speaks PostgreSQL's protocol but lacks LISTEN. The log reports this only once.
TEST_F(PostgresFollow, ServersPollIfTheDatabaseRefusesToListen) {
  const CapturedLog log;
  options_.poll_interval = options_.heartbeat = std::chrono::milliseconds(10);
  proxy_->RefuseToListen();
  Start();
  other_ = StartPeer();
  {
    Watcher watcher(hulls_->registry());
    for (int i = 0; i < 3; ++i) {
      const std::string id = absl::StrCat("h", i);
      ASSERT_TRUE(other_->Create(id).ok());
      EXPECT_TRUE(watcher.Reports(id));
    }
  }
  EndAll();
  const std::string text = log.text();
  const std::string warning = "the database refused to report commits of peer servers";
  const size_t first = text.find(warning);
  ASSERT_NE(first, std::string::npos) << text;
  EXPECT_EQ(text.find(warning, first + 1), std::string::npos) << text;
  EXPECT_EQ(proxy_->QueryCount("LISTEN hulld_batches"), 1);
}

}  // namespace postgres_follow_test
}  // namespace hulld::server
