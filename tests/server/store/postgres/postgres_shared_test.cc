// What several servers over one database know of each other's changes.
#include <absl/strings/str_cat.h>

#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/server/store/postgres/postgres_shared_fixture.h"

namespace hulld::server {
namespace postgres_shared_test {

using ::testing::HasSubstr;

class PostgresShared : public PostgresSharedTest {
 protected:
  void PollOnlyOnDemand() { options_.poll_interval = options_.heartbeat = std::chrono::hours(1); }
  static absl::StatusOr<PutBodyResult> PutBody(PostgresRegistry& server, const std::string& id,
                                               std::optional<uint64_t> if_revision = {}) {
    StoredBody body;
    body.record.body_id = id;
    body.hull_ids = {"piece"};
    body.pieces = {{0, Pose()}};
    return PostgresRegistry::Wait<PutBodyResult>([&](const Reply<PutBodyResult>& done) {
      server.registry().changes().PutBody(std::move(body), if_revision, done);
    });
  }
  // Returns the hull as currently stored.
  StoredHull KeptHull(const std::string& id) {
    StoredHull kept;
    const absl::Status read = hulls_->store().ForEachRecord(
        [&](const std::string& hull_id, const auto& hull) {
          if (hull_id == id && hull.ok()) kept = *hull;
        },
        [](const auto&...) {});
    EXPECT_TRUE(read.ok()) << read;
    return kept;
  }
  static std::vector<std::string> Listed(PostgresRegistry& server) {
    EXPECT_TRUE(server.registry().peers().AwaitPeers({}).ok());
    std::vector<std::string> ids;
    const absl::StatusOr<RecordPage> page = server.registry().records().List("", "", 100);
    EXPECT_TRUE(page.ok()) << page.status();
    if (!page.ok()) return ids;
    for (const HullChange& hull : page->entries) {
      ids.push_back(hull.record.hull_id);
    }
    return ids;
  }
};

// Holds regardless of how rarely the server polls.
TEST_F(PostgresShared, APeerServerServesAcknowledgedChanges) {
  PollOnlyOnDemand();
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  EXPECT_EQ(Received(*other, "h"), 8);
  ASSERT_TRUE(other->Put("h", {{9, 9, 9}}).ok());
  EXPECT_EQ(Received(*hulls_, "h"), 9);
  EXPECT_THAT(CanonicalOf(*hulls_->View("h")).vertices(),
              ::testing::ElementsAreArray(CanonicalOf(*other->View("h")).vertices()));
  // No vertex, hence no revision.
  const uint64_t revision = hulls_->View("h")->record.revision;
  ASSERT_TRUE(hulls_->Put("h", {{0.5, 0.5, 0.5}}).ok());
  EXPECT_EQ(Received(*other, "h"), 10);
  EXPECT_EQ(other->View("h")->record.revision, revision);
  ASSERT_TRUE(other->Delete("h").ok());
  EXPECT_TRUE(absl::IsNotFound(hulls_->View("h").status()));
  ASSERT_TRUE(hulls_->Create("i").ok());
  EXPECT_TRUE(absl::IsAlreadyExists(other->Create("i").status()));
  EXPECT_THAT(Listed(*other), ::testing::ElementsAre("i"));
  EXPECT_EQ(other->registry().Sizes().vertex_count, 0);
}

TEST_F(PostgresShared, RevisionsAreTotallyOrdered) {
  Start();
  const Server other = StartPeer();
  uint64_t last = 0;
  for (int i = 0; i < 6; ++i) {
    PostgresRegistry& server = i % 2 == 0 ? *hulls_ : *other;
    const auto created = server.Create(absl::StrCat("h", i));
    ASSERT_TRUE(created.ok()) << created.status();
    EXPECT_EQ(created->hull.create_revision, last + 1);
    last = created->hull.create_revision;
  }
  EXPECT_EQ(hulls_->store().id(), other->store().id());
}

TEST_F(PostgresShared, ASequenceIsCountedOnceAcrossServers) {
  Start();
  const Server other = StartPeer();
  const auto here = hulls_->Open("h");
  ASSERT_TRUE(here.ok());
  const auto there = other->Open("h");
  ASSERT_TRUE(there.ok());
  ASSERT_TRUE(hulls_->Append(here->session, 1, CubeCorners()).ok());
  // The writer moved to the peer server and resends the chunks that it has no acknowledgement for.
  const auto again = other->Append(there->session, 1, CubeCorners());
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->already_applied);
  ASSERT_TRUE(other->Append(there->session, 2, {{9, 9, 9}}).ok());
  const auto late = hulls_->Append(here->session, 2, {{9, 9, 9}});
  ASSERT_TRUE(late.ok()) << late.status();
  EXPECT_TRUE(late->already_applied);
  EXPECT_TRUE(hulls_->Append(here->session, 3, {{10, 9, 9}}).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(other->Append(there->session, 5, {{1, 1, 1}}).status()));
  EXPECT_EQ(Received(*other, "h"), 10);
  EXPECT_EQ(other->Open("h")->last_sequence, 3);
}

// Each writer sends each chunk through both servers, like a client that lost an answer.
TEST_F(PostgresShared, ManyWritersOfOneHullLoseNothingAndCountNothingTwice) {
  Start();
  const Server other = StartPeer();
  constexpr int kWriters = 4;
  constexpr uint64_t kChunks = 25;
  const std::vector<Vector> points = SpherePoints(kWriters * kChunks);
  std::vector<std::thread> writers;
  writers.reserve(kWriters);
  for (int w = 0; w < kWriters; ++w) {
    writers.emplace_back([&, w] {
      const std::string name = absl::StrCat("w", w);
      const auto here = hulls_->Open("h", name);
      const auto there = other->Open("h", name);
      ASSERT_TRUE(here.ok() && there.ok()) << here.status() << there.status();
      for (uint64_t sequence = 1; sequence <= kChunks; ++sequence) {
        const Vector& point = points[w * kChunks + sequence - 1];
        auto first = std::async(std::launch::async,
                                [&] { return other->Append(there->session, sequence, {point}); });
        const auto second = hulls_->Append(here->session, sequence, {point});
        const auto result = first.get();
        ASSERT_TRUE(result.ok() && second.ok()) << result.status() << second.status();
        EXPECT_NE(result->already_applied, second->already_applied);
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  for (PostgresRegistry* server : {hulls_.get(), other.get()}) {
    const auto view = server->View("h");
    EXPECT_EQ(view->record.counts.received, points.size());
    EXPECT_EQ(view->record.counts.outside, points.size());
    EXPECT_EQ(CanonicalOf(*view).vertices().size(), points.size());
  }
}

TEST_F(PostgresShared, OneOfTwoConditionsOnTheSameRevisionSucceeds) {
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const uint64_t revision = other->View("h")->record.revision;
  auto first = std::async(std::launch::async,
                          [&] { return Replace(*hulls_, "h", SpherePoints(20), revision); });
  const auto second = Replace(*other, "h", SpherePoints(30), revision);
  const auto result = first.get();
  EXPECT_NE(result.ok(), second.ok());
  EXPECT_TRUE(absl::IsAborted(result.ok() ? second.status() : result.status()));
  EXPECT_EQ(Received(*hulls_, "h"), result.ok() ? 20 : 30);
  EXPECT_EQ(Received(*other, "h"), result.ok() ? 20 : 30);
}

TEST_F(PostgresShared, CreationsDeletionsAndReplacementsOfOneIdTakeTurns) {
  Start();
  const Server other = StartPeer();
  std::vector<std::thread> threads;
  std::atomic<int> balance = 0;
  for (PostgresRegistry* server : {hulls_.get(), other.get()}) {
    threads.emplace_back([&balance, server] {
      for (int i = 0; i < 30; ++i) {
        const auto created = server->Create("h");
        if (created.ok()) ++balance;
        EXPECT_TRUE(created.ok() || absl::IsAlreadyExists(created.status())) << created.status();
        const auto replaced = Replace(*server, "h", CubeCorners(i));
        EXPECT_TRUE(replaced.ok()) << replaced.status();
        if (replaced.ok() && replaced->created) ++balance;
        const auto deleted = server->Delete("h");
        if (deleted.ok()) --balance;
        EXPECT_TRUE(deleted.ok() || absl::IsNotFound(deleted.status())) << deleted.status();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(balance, 0);
  EXPECT_TRUE(absl::IsNotFound(hulls_->View("h").status()));
  EXPECT_TRUE(absl::IsNotFound(other->View("h").status()));
  EXPECT_EQ(RunSql("SELECT count(*) FROM hulld.hulls").front(), "0");
  EXPECT_EQ(hulls_->registry().Sizes().vertex_count, 0);
}

TEST_F(PostgresShared, BodiesAndHullsShareTheirIdsAcrossServers) {
  Start();
  const Server other = StartPeer();
  const auto put = PutBody(*hulls_, "b");
  ASSERT_TRUE(put.ok()) << put.status();
  EXPECT_TRUE(absl::IsAlreadyExists(other->Create("b").status()));
  const auto again = PutBody(*other, "b", put->body.record.revision);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_FALSE(again->created);
  EXPECT_EQ(again->body.record.create_revision, put->body.record.create_revision);
  EXPECT_TRUE(absl::IsAborted(PutBody(*hulls_, "b", put->body.record.revision).status()));
  ASSERT_TRUE(hulls_->registry().peers().AwaitPeers({}).ok());
  const std::string id = "b";
  EXPECT_EQ(hulls_->registry().records().FindBodies(std::span(&id, 1)).bodies[0]->record().revision,
            again->body.record.revision);
  const auto deleted = PostgresRegistry::Wait<uint64_t>([&](const Reply<uint64_t>& done) {
    hulls_->registry().changes().Delete("body", "b", std::nullopt, done);
  });
  EXPECT_TRUE(deleted.ok()) << deleted.status();
  EXPECT_TRUE(other->Create("b").ok());
  EXPECT_FALSE(other->registry().has_bodies());
}

TEST_F(PostgresShared, SessionsEndOnAllServersWhenTheirHullIsDeleted) {
  Start();
  const Server other = StartPeer();
  std::promise<absl::Status> gone;
  const auto opened = PostgresRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
    hulls_->registry().changes().OpenAppend(
        "h", "w", true, [&](const absl::Status& status) { gone.set_value(status); },
        std::move(done));
  });
  ASSERT_TRUE(opened.ok()) << opened.status();
  ASSERT_TRUE(hulls_->Append(opened->session, 1, CubeCorners()).ok());
  ASSERT_TRUE(other->Delete("h").ok());
  // No call reaches this server.
  EXPECT_TRUE(absl::IsFailedPrecondition(gone.get_future().get()));
  EXPECT_TRUE(absl::IsFailedPrecondition(hulls_->Append(opened->session, 2, {{9, 9, 9}}).status()));
}

TEST_F(PostgresShared, AWatchReportsChangesOfPeerServers) {
  Start();
  const Server other = StartPeer();
  std::atomic<int> ready = 0;
  const auto watch = hulls_->registry().feed().Open({.lists_existing = false}, {}, [&] {
    ++ready;
    ready.notify_all();
  });
  ASSERT_TRUE(watch.ok());
  std::vector<std::pair<std::string, ChangeKind>> reported;
  int waited = 0;
  const auto take_until = [&](size_t count) {
    while (reported.size() < count) {
      const auto batch = hulls_->registry().feed().Next(*watch);
      ASSERT_TRUE(batch.ok()) << batch.status();
      for (const HullChange& change : batch->changes) {
        reported.emplace_back(change.record.hull_id, change.kind);
      }
      if (batch->waits) ready.wait(waited++);
    }
  };
  ASSERT_TRUE(other->Create("h").ok());
  take_until(1);
  ASSERT_TRUE(other->Put("h", CubeCorners()).ok());
  take_until(2);
  ASSERT_TRUE(other->Delete("h").ok());
  take_until(3);
  hulls_->registry().feed().Close(*watch);
  using Reported = std::pair<std::string, ChangeKind>;
  EXPECT_THAT(reported, ::testing::ElementsAre(Reported("h", ChangeKind::kCreated),
                                               Reported("h", ChangeKind::kChanged),
                                               Reported("h", ChangeKind::kDeleted)));
}

// The stream keeps the hull registered but does not pin its memory.
TEST_F(PostgresShared, AnEvictedHullOfAnOpenStreamIsReadAgain) {
  Limits limits;
  limits.memory_limit = 1 << 20;
  auto store = Open();
  ASSERT_TRUE(store.ok()) << store.status();
  hulls_ = std::make_unique<PostgresRegistry>(*std::move(store), limits);
  ASSERT_TRUE(hulls_->loaded().ok());
  const Server other = StartPeer();
  const auto opened = hulls_->Open("h");
  ASSERT_TRUE(hulls_->Append(opened->session, 1, CubeCorners()).ok());
  // Exceeds the limit, so that unused hulls are evicted.
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(hulls_->Put(absl::StrCat("large/", i), SpherePoints(1000)).ok());
    ASSERT_TRUE(hulls_->View(absl::StrCat("large/", i)).ok());
  }
  ASSERT_TRUE(other->Put("h", {{9, 9, 9}}, "v").ok());
  EXPECT_EQ(Received(*hulls_, "h"), 9);
  ASSERT_TRUE(hulls_->Append(opened->session, 2, {{-9, 9, 9}}).ok());
  EXPECT_EQ(Received(*other, "h"), 10);
}

// Both changes of an ID form one event. A watch of hulls alone reports the hull.
TEST_F(PostgresShared, WatchesReportIdsThatBecameABodyOrAHull) {
  options_.notices = false;
  options_.poll_interval = options_.heartbeat = std::chrono::hours(1);
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(other->Create("was-hull").ok());
  ASSERT_TRUE(PutBody(*other, "was-body").ok());
  ASSERT_TRUE(PutBody(*other, "replaced").ok());
  Registry& registry = hulls_->registry();
  ASSERT_TRUE(registry.peers().AwaitPeers({}).ok());
  ChangeFeed& feed = registry.feed();
  const auto watch_hulls = feed.Open({.lists_existing = false}, {}, [] {});
  const auto watch_both = feed.Open({.bodies = true, .lists_existing = false}, {}, [] {});
  ASSERT_TRUE(watch_hulls.ok() && watch_both.ok());
  const auto delete_body = [&](const std::string& id) {
    return PostgresRegistry::Wait<uint64_t>([&](const Reply<uint64_t>& done) {
      other->registry().changes().Delete("body", id, std::nullopt, done);
    });
  };
  ASSERT_TRUE(other->Delete("was-hull").ok());
  ASSERT_TRUE(PutBody(*other, "was-hull").ok());
  ASSERT_TRUE(delete_body("was-body").ok());
  ASSERT_TRUE(other->Create("was-body").ok());
  ASSERT_TRUE(delete_body("replaced").ok());
  ASSERT_TRUE(PutBody(*other, "replaced").ok());
  ASSERT_TRUE(PutBody(*other, "replaced").ok());
  ASSERT_TRUE(registry.peers().AwaitPeers({}).ok());

  using Reported = std::tuple<std::string, ChangeKind, bool>;
  const auto told_to = [&](const std::shared_ptr<Watch>& watch) {
    std::vector<Reported> reported;
    for (bool waits = false; !waits;) {
      const auto batch = feed.Next(watch);
      if (!batch.ok()) break;
      for (const HullChange& change : batch->changes) {
        reported.emplace_back(change.record.hull_id, change.kind, change.is_body);
      }
      waits = batch->waits;
    }
    feed.Close(watch);
    return reported;
  };
  EXPECT_THAT(told_to(*watch_hulls),
              ::testing::ElementsAre(Reported("was-hull", ChangeKind::kDeleted, false),
                                     Reported("was-body", ChangeKind::kCreated, false)));
  EXPECT_THAT(told_to(*watch_both),
              ::testing::ElementsAre(Reported("was-hull", ChangeKind::kReplaced, true),
                                     Reported("was-body", ChangeKind::kReplaced, false),
                                     Reported("replaced", ChangeKind::kReplaced, true)));
}

// Data of one record is not returned to a caller with an older record.
TEST_F(PostgresShared, ReadsWithAnOldRecordAreAborted) {
  PollOnlyOnDemand();
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const StoredHull former = KeptHull("h");
  PostgresStore& store = hulls_->store();
  EXPECT_EQ(*store.LoadSequence(former.record, "w"), 1);
  // No vertex, hence no revision; the sequence still advances.
  ASSERT_TRUE(other->Put("h", {{0.5, 0.5, 0.5}}).ok());
  EXPECT_TRUE(absl::IsAborted(store.LoadSequence(former.record, "w").status()));
  EXPECT_EQ(*store.LoadSequence(KeptHull("h").record, "w"), 2);
  EXPECT_TRUE(store.LoadVertices(former).ok());
  ASSERT_TRUE(Replace(*other, "h", SpherePoints(20)).ok());
  EXPECT_TRUE(absl::IsAborted(store.LoadVertices(former).status()));
  ASSERT_TRUE(other->Delete("h").ok());
  EXPECT_TRUE(absl::IsAborted(store.LoadVertices(former).status()));
  EXPECT_TRUE(absl::IsAborted(store.LoadSequence(former.record, "w").status()));
}

// The server's knowledge of the hull is stale, so deciding from it would be wrong in each case.
TEST_F(PostgresShared, ChangesAreDecidedByPeerChanges) {
  PollOnlyOnDemand();
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Create("h").ok());
  ASSERT_TRUE(other->Delete("h").ok());
  EXPECT_TRUE(hulls_->Create("h").ok());
  ASSERT_TRUE(other->Delete("h").ok());
  EXPECT_TRUE(absl::IsNotFound(hulls_->Delete("h").status()));
  ASSERT_TRUE(other->Create("h").ok());
  EXPECT_TRUE(hulls_->Delete("h").ok());
  const auto replaced = Replace(*other, "h", CubeCorners());
  ASSERT_TRUE(replaced.ok());
  EXPECT_TRUE(Replace(*hulls_, "h", SpherePoints(20), replaced->hull.revision).ok());
  ASSERT_TRUE(other->Put("h", {{9, 9, 9}}).ok());
  EXPECT_EQ(hulls_->Open("h", "w", false)->last_sequence, 1);
  // Repeated chunks, and the chunks after them.
  const auto opened = hulls_->Open("h");
  ASSERT_TRUE(other->Put("h", {{10, 9, 9}}).ok());
  EXPECT_TRUE(hulls_->Append(opened->session, 2, {{10, 9, 9}})->already_applied);
  ASSERT_TRUE(other->Put("h", {{11, 9, 9}}).ok());
  const auto next = hulls_->Append(opened->session, 4, {{12, 9, 9}});
  EXPECT_TRUE(next.ok()) << next.status();
  EXPECT_EQ(Received(*other, "h"), 24);
}

TEST_F(PostgresShared, ServersThatStartTogetherCreateOneStore) {
  constexpr size_t kServers = 8;
  for (int round = 0; round < 2; ++round) {
    options_.conninfo = cluster().Conninfo(cluster().MakeDatabase());
    std::vector<std::future<absl::StatusOr<std::unique_ptr<PostgresStore>>>> opening;
    for (size_t i = 0; i < kServers; ++i) {
      opening.push_back(std::async(std::launch::async, [this] { return Open(); }));
    }
    std::vector<Server> servers;
    for (auto& each : opening) {
      auto store = each.get();
      ASSERT_TRUE(store.ok()) << store.status();
      servers.push_back(std::make_unique<PostgresRegistry>(*std::move(store)));
      ASSERT_TRUE(servers.back()->loaded().ok()) << servers.back()->loaded();
      EXPECT_EQ(servers.back()->store().id(), servers.front()->store().id());
      EXPECT_EQ(servers.back()->store().epoch(), 1);
    }
    std::vector<std::string> ids;
    for (size_t i = 0; i < kServers; ++i) {
      ids.push_back(absl::StrCat("h", i));
      ASSERT_TRUE(servers[i]->Create(ids.back()).ok());
    }
    for (const Server& server : servers) {
      EXPECT_THAT(Listed(*server), ::testing::ElementsAreArray(ids));
    }
  }
}

TEST_F(PostgresShared, AnExclusiveServerAndSharedServersExcludeEachOther) {
  options_.shared = false;
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  options_.shared = true;
  options_.should_stop = [] { return true; };
  // It waits for the server that requires exclusive access.
  EXPECT_TRUE(absl::IsCancelled(Open().status()));
  hulls_ = nullptr;
  options_.should_stop = {};
  Start();
  EXPECT_EQ(Received(*hulls_, "h"), 8);
  options_.shared = false;
  options_.take_over = true;
  const Server alone = MakeRegistry();
  EXPECT_TRUE(absl::IsUnavailable(hulls_->Put("h", {{9, 9, 9}}).status()));
  EXPECT_TRUE(absl::IsUnavailable(hulls_->View("h").status()));
  EXPECT_EQ(Received(*alone, "h"), 8);
  EXPECT_TRUE(alone->Put("h", {{9, 9, 9}}).ok());
}

TEST_F(PostgresShared, WithoutSyncItIsRefused) {
  RunSql("ALTER ROLE hulld SET synchronous_commit = off");
  const absl::Status status = Open().status();
  RunSql("ALTER ROLE hulld RESET synchronous_commit");
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("synchronous_commit"));
}

}  // namespace postgres_shared_test
}  // namespace hulld::server
