// Records are looked up on demand instead of being read at the start, and each batch updates the
// totals of the store.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <semaphore>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/store/postgres/postgres_fixture.h"

namespace hulld::server {
namespace postgres_records_test {

class PostgresRecords : public PostgresTest {
 protected:
  // The database's own counts.
  std::string Counted() const { return RunSql("SELECT count(*) FROM hulld.hulls").front(); }
  std::string Kept() const { return RunSql("SELECT hulls FROM hulld.store").front(); }
  std::string CountedBodies() const { return RunSql("SELECT count(*) FROM hulld.bodies").front(); }
  std::string KeptBodies() const { return RunSql("SELECT bodies FROM hulld.store").front(); }
  uint64_t KeptVertices() const {
    return std::stoull(RunSql("SELECT vertices FROM hulld.store").front());
  }
  static uint64_t ResidentPages() {
    std::ifstream file("/proc/self/statm");
    uint64_t size = 0;
    uint64_t resident = 0;
    file >> size >> resident;
    return resident;
  }
  static absl::StatusOr<PutBodyResult> PutBody(PostgresRegistry& server, const std::string& id,
                                               size_t pieces = 1) {
    StoredBody body;
    body.record.body_id = id;
    body.hull_ids = {"a"};
    body.pieces.assign(pieces, StoredPiece());
    return PostgresRegistry::Wait<PutBodyResult>([&](const Reply<PutBodyResult>& done) {
      server.registry().changes().PutBody(std::move(body), std::nullopt, done);
    });
  }
  static absl::StatusOr<uint64_t> DeleteBody(PostgresRegistry& server, const std::string& id) {
    return PostgresRegistry::Wait<uint64_t>([&](const Reply<uint64_t>& done) {
      server.registry().changes().Delete("body", id, std::nullopt, done);
    });
  }
  // DATA_LOSS or NOT_FOUND if the record is unavailable.
  static absl::StatusOr<BodyRecord> FindBody(PostgresRegistry& server, const std::string& id) {
    const FoundBodies found = server.registry().records().FindBodies(std::span(&id, 1));
    if (!found.status.ok()) return found.status;
    const std::shared_ptr<const Body>& body = found.bodies.front();
    if (body == nullptr) return absl::NotFoundError("none");
    if (!body->damage().ok()) return body->damage();
    return body->record();
  }
  void StartOverMany(bool bodies);
  // Stores hulls of 8 vertices and deletes one.
  void FillSome() {
    ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
    ASSERT_TRUE(hulls_->Put("b", CubeCorners()).ok());
    ASSERT_TRUE(hulls_->Create("c").ok());
    ASSERT_TRUE(hulls_->Put("gone", CubeCorners()).ok());
    ASSERT_TRUE(hulls_->Delete("gone").ok());
  }
};

TEST_F(PostgresRecords, NoRecordIsReadBeforeItIsRequested) {
  Start();
  FillSome();
  RunSql("UPDATE hulld.hulls SET record = '\\x00' WHERE hull_id = 'b'");
  Start();
  EXPECT_EQ(hulls_->registry().Cache().damaged, 0);
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, 3);
  EXPECT_TRUE(hulls_->View("a").ok());
  EXPECT_TRUE(absl::IsNotFound(hulls_->View("gone").status()));
  EXPECT_EQ(hulls_->registry().Cache().damaged, 0);
  EXPECT_TRUE(absl::IsDataLoss(hulls_->View("b").status()));
  EXPECT_EQ(hulls_->registry().Cache().damaged, 1);
}

// A record may be newer than the registry's last applied commit. The lookup then waits for the
// committer to apply it, even if no other commit follows.
TEST_F(PostgresRecords, ASingleActiveServerHasNoPeersToFollow) {
  const auto store = Open();
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_EQ((*store)->peers(), nullptr);
}

TEST_F(PostgresRecords, AnUnmatchedPrefixListsNothing) {
  Start();
  FillSome();
  for (const std::string& prefix : {std::string("a\0", 2), std::string("\xff\xfe"),
                                    std::string("\xc3\xa9"), std::string("a b")}) {
    const auto page = hulls_->registry().records().List(prefix, "", 10, {});
    ASSERT_TRUE(page.ok()) << page.status();
    EXPECT_TRUE(page->entries.empty());
  }
  EXPECT_EQ(hulls_->store().failures().read, 0);
}

TEST_F(PostgresRecords, EachBatchUpdatesTheTotals) {
  for (const bool shared : {false, true}) {
    SCOPED_TRACE(shared);
    options_.shared = shared;
    Start();
    const uint64_t before = hulls_->registry().Sizes().hull_count;
    EXPECT_EQ(before, shared ? 3 : 0);
    if (!shared) FillSome();
    const RegistrySizes sizes = hulls_->registry().Sizes();
    EXPECT_EQ(sizes.hull_count, 3);
    EXPECT_EQ(sizes.vertex_count, 16);
    EXPECT_EQ(Kept(), Counted());
    EXPECT_EQ(KeptVertices(), 16);
  }
  // The peer server learns the totals without looking up any record.
  const std::unique_ptr<PostgresRegistry> other = MakeRegistry();
  ASSERT_TRUE(hulls_->Delete("a").ok());
  ASSERT_TRUE(hulls_->Put("b", {{9, 9, 9}}, "other").ok());
  ASSERT_TRUE(other->registry().peers().AwaitPeers({}).ok());
  EXPECT_EQ(other->registry().Sizes().hull_count, 2);
  EXPECT_EQ(other->registry().Sizes().vertex_count, hulls_->registry().Sizes().vertex_count);
  EXPECT_EQ(KeptVertices(), hulls_->registry().Sizes().vertex_count);
  EXPECT_EQ(Kept(), Counted());
  for (const char* id : {"body-1", "body-2"}) ASSERT_TRUE(PutBody(*hulls_, id).ok());
  ASSERT_TRUE(PutBody(*hulls_, "body-1").ok());
  ASSERT_TRUE(DeleteBody(*hulls_, "body-2").ok());
  ASSERT_TRUE(other->registry().peers().AwaitPeers({}).ok());
  EXPECT_EQ(hulls_->registry().Sizes().body_count, 1);
  EXPECT_EQ(other->registry().Sizes().body_count, 1);
  EXPECT_EQ(KeptBodies(), CountedBodies());
}

TEST_F(PostgresRecords, NoBodyIsReadBeforeItIsRequested) {
  for (const bool shared : {false, true}) {
    SCOPED_TRACE(shared);
    options_.shared = shared;
    Start();
    FillSome();
    for (const char* id : {"body-1", "body-2", "body-3"}) {
      ASSERT_TRUE(PutBody(*hulls_, id).ok());
    }
    RunSql("UPDATE hulld.bodies SET body = '\\x00' WHERE body_id = 'body-2'");
    Start();
    EXPECT_EQ(hulls_->registry().Cache().damaged, 0);
    EXPECT_EQ(hulls_->registry().Sizes().body_count, 3);
    EXPECT_TRUE(FindBody(*hulls_, "body-1").ok());
    EXPECT_TRUE(absl::IsNotFound(FindBody(*hulls_, "a").status()));
    EXPECT_TRUE(absl::IsNotFound(FindBody(*hulls_, "none").status()));
    EXPECT_EQ(hulls_->registry().Cache().damaged, 0);
    EXPECT_TRUE(absl::IsDataLoss(FindBody(*hulls_, "body-2").status()));
    EXPECT_EQ(hulls_->registry().Cache().damaged, 1);
    // A body that was never looked up also blocks a hull of its ID.
    EXPECT_TRUE(absl::IsAlreadyExists(hulls_->Create("body-3").status()));
    ASSERT_TRUE(DeleteBody(*hulls_, "body-3").ok());
    EXPECT_TRUE(hulls_->Create("body-3").ok());
    EXPECT_TRUE(absl::IsAlreadyExists(PutBody(*hulls_, "body-3").status()));
    // A put replaces a damaged body.
    ASSERT_TRUE(PutBody(*hulls_, "body-2").ok());
    EXPECT_EQ(KeptBodies(), CountedBodies());
    for (const char* id : {"body-1", "body-2"}) ASSERT_TRUE(DeleteBody(*hulls_, id).ok());
    EXPECT_EQ(KeptBodies(), "0");
    EXPECT_EQ(hulls_->registry().Sizes().body_count, 0);
    for (const char* id : {"a", "b", "c", "body-3"}) ASSERT_TRUE(hulls_->Delete(id).ok());
  }
}

TEST_F(PostgresRecords, APageOfLargeBodiesIsShortAndHasANextPage) {
  Start();
  constexpr size_t kPieces = 10'000;
  // About 600 KB each: more than one page holds.
  constexpr int kBodies = 40;
  for (int i = 0; i < kBodies; ++i) {
    ASSERT_TRUE(PutBody(*hulls_, absl::StrCat("large-", 100 + i), kPieces).ok());
  }
  Start();
  std::vector<std::string> listed;
  size_t pages = 0;
  for (std::string after;;) {
    const absl::StatusOr<RecordPage> page =
        hulls_->registry().records().List("large-", after, 1000, {}, {.bodies = true});
    ASSERT_TRUE(page.ok()) << page.status();
    ASSERT_FALSE(page->entries.empty());
    ++pages;
    for (const HullChange& body : page->entries) listed.push_back(body.record.hull_id);
    after = listed.back();
    if (!page->more) break;
  }
  EXPECT_EQ(listed.size(), kBodies);
  EXPECT_TRUE(std::ranges::is_sorted(listed));
  EXPECT_GT(pages, 1);
  EXPECT_LT(pages, 4);
}

// A watch reports a peer's change of a body that is not in memory with its correct kind.
TEST_F(PostgresRecords, AWatchReportsBodiesThatAreNotInMemory) {
  options_.shared = true;
  Start();
  for (const char* id : {"changes", "ends", "to-hull"}) {
    ASSERT_TRUE(PutBody(*hulls_, id).ok());
  }
  ASSERT_TRUE(hulls_->Create("to-body").ok());
  const std::unique_ptr<PostgresRegistry> other = MakeRegistry();
  Registry& registry = other->registry();
  const auto open = [&](bool bodies) {
    const WatchTarget target{.bodies = bodies, .lists_existing = false};
    const auto watch = registry.feed().Open(target, {}, [] {});
    EXPECT_TRUE(watch.ok()) << watch.status();
    return *watch;
  };
  const auto of_all = open(true);
  const auto of_hulls = open(false);
  ASSERT_TRUE(PutBody(*hulls_, "changes").ok());
  ASSERT_TRUE(DeleteBody(*hulls_, "ends").ok());
  ASSERT_TRUE(DeleteBody(*hulls_, "to-hull").ok());
  ASSERT_TRUE(hulls_->Create("to-hull").ok());
  ASSERT_TRUE(hulls_->Delete("to-body").ok());
  ASSERT_TRUE(PutBody(*hulls_, "to-body").ok());
  ASSERT_TRUE(PutBody(*hulls_, "new").ok());
  ASSERT_TRUE(registry.peers().AwaitPeers({}).ok());
  struct Reported {
    std::string id;
    ChangeKind kind;
    bool is_body;
    bool operator==(const Reported&) const = default;
  };
  const auto reported = [&](const std::shared_ptr<Watch>& watch) {
    std::vector<Reported> all;
    const absl::StatusOr<WatchBatch> batch = registry.feed().Next(watch);
    EXPECT_TRUE(batch.ok()) << batch.status();
    for (const HullChange& change : batch->changes) {
      all.push_back({change.record.hull_id, change.kind, change.is_body});
    }
    registry.feed().Close(watch);
    return all;
  };
  const std::vector<Reported> expected = {{"changes", ChangeKind::kChanged, true},
                                          {"ends", ChangeKind::kDeleted, true},
                                          {"to-hull", ChangeKind::kReplaced, false},
                                          {"to-body", ChangeKind::kReplaced, true},
                                          {"new", ChangeKind::kCreated, true}};
  EXPECT_TRUE(reported(of_all) == expected);
  const std::vector<Reported> of_hulls_alone = {{"to-hull", ChangeKind::kCreated, false},
                                                {"to-body", ChangeKind::kDeleted, false}};
  EXPECT_TRUE(reported(of_hulls) == of_hulls_alone);
}

// HULLD_RECORDS sets the number of records for manual runs. Prints the cost of a start and that of
// reading all records.
void PostgresRecords::StartOverMany(bool bodies) {
  const char* const wanted = std::getenv("HULLD_RECORDS");
  const uint64_t count = wanted == nullptr ? 20'000 : std::stoull(wanted);
  const auto id_of = [](uint64_t i) { return absl::StrCat("id-", i); };
  {
    const auto store = Open();
    ASSERT_TRUE(store.ok()) << store.status();
    for (uint64_t first = 0; first < count; first += 5000) {
      std::vector<Change> changes(std::min<uint64_t>(5000, count - first));
      std::vector<Change*> pointers;
      for (Change& change : changes) {
        const std::string id = id_of(first + pointers.size());
        change.begins = true;
        if (bodies) {
          change.body = std::make_shared<StoredBody>(
              StoredBody{{id, 0, 0}, {"piece-1", "piece-2"}, {{0, {}}, {1, {}}, {0, {}}}});
        } else {
          change.hull.record.hull_id = id;
        }
        pointers.push_back(&change);
      }
      ASSERT_TRUE((*store)->Commit(pointers).ok());
    }
  }
  using Clock = std::chrono::steady_clock;
  const auto seconds_since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  const uint64_t resident_before = ResidentPages();
  const Clock::time_point start = Clock::now();
  Start();
  const RegistrySizes sizes = hulls_->registry().Sizes();
  EXPECT_EQ(bodies ? sizes.body_count : sizes.hull_count, count);
  const std::string last = id_of(count - 1);
  EXPECT_TRUE(bodies ? FindBody(*hulls_, last).ok() : hulls_->View(last).ok());
  const double taken = seconds_since(start);
  const uint64_t resident = ResidentPages() - resident_before;
  const Clock::time_point all_start = Clock::now();
  std::map<std::string, StoredHull> all_hulls;
  std::map<std::string, StoredBody> all_bodies;
  const absl::Status read = hulls_->store().ForEachRecord(
      [&](const std::string& id, absl::StatusOr<StoredHull> hull) { all_hulls.emplace(id, *hull); },
      [&](const std::string& id, absl::StatusOr<StoredBody> body) {
        all_bodies.emplace(id, *std::move(body));
      });
  ASSERT_TRUE(read.ok()) << read;
  EXPECT_EQ(all_hulls.size() + all_bodies.size(), count);
  if (wanted == nullptr) return;
  std::cout << count << (bodies ? " bodies: " : " hulls: ") << taken << " s and "
            << resident * 4 / 1024 << " MiB to the first answer; to read all of them "
            << seconds_since(all_start) << " s, and "
            << (ResidentPages() - resident_before) * 4 / 1024 << " MiB with them\n";
}

TEST_F(PostgresRecords, AServerStartsOverManyHulls) { StartOverMany(false); }

TEST_F(PostgresRecords, AServerStartsOverManyBodies) { StartOverMany(true); }

TEST_F(PostgresRecords, AListIsReadPageByPage) {
  Start();
  FillSome();
  Start();
  std::vector<std::string> listed;
  for (std::string after;;) {
    const absl::StatusOr<RecordPage> page = hulls_->registry().records().List("", after, 1);
    ASSERT_TRUE(page.ok()) << page.status();
    ASSERT_EQ(page->entries.size(), 1);
    after = page->entries.front().record.hull_id;
    listed.push_back(after);
    if (!page->more) break;
  }
  EXPECT_EQ(listed, (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_FALSE(hulls_->registry().records().List("b", "", 10)->more);
  EXPECT_EQ(hulls_->registry().records().List("b", "", 10)->entries.size(), 1);
  EXPECT_TRUE(hulls_->registry().records().List("", "c", 10)->entries.empty());
}

// One hull is not in memory, one is known to be deleted, one was recreated, and one was recreated
// as a body.
TEST_F(PostgresRecords, AWatchReportsExistingAndDeletedRecords) {
  Start();
  FillSome();
  ASSERT_TRUE(hulls_->Create("d").ok());
  Registry& registry = hulls_->registry();
  registry.SetRecordCapacity(0);
  const uint64_t before = registry.Sizes().store_revision;
  ASSERT_TRUE(hulls_->Delete("a").ok());
  ASSERT_TRUE(hulls_->Delete("c").ok());
  ASSERT_TRUE(hulls_->Create("a").ok());
  ASSERT_TRUE(hulls_->Delete("b").ok());
  ASSERT_TRUE(PutBody(*hulls_, "b").ok());
  // Evicts the cached knowledge of these IDs.
  for (int i = 0; i < 100; ++i) hulls_->View(absl::StrCat("none-", i)).IgnoreError();
  EXPECT_FALSE(registry.records().FindBodies(std::vector<std::string>{"b"}, {}, false).status.ok());
  const auto reported = [&](uint64_t after, bool bodies = false) {
    std::vector<std::pair<std::string, bool>> events;
    const WatchTarget target{.bodies = bodies};
    const auto ready = std::make_shared<std::counting_semaphore<>>(0);
    const auto watch =
        registry.feed().Open(target, {after, hulls_->store().id()}, [ready] { ready->release(); });
    EXPECT_TRUE(watch.ok()) << watch.status();
    for (bool is_synced = !watch.ok(); !is_synced;) {
      const absl::StatusOr<WatchBatch> batch = registry.feed().Next(*watch);
      EXPECT_TRUE(batch.ok()) << batch.status();
      if (!batch.ok()) break;
      for (const HullChange& change : batch->changes) {
        events.emplace_back(change.record.hull_id, change.kind != ChangeKind::kDeleted);
      }
      is_synced = batch->synced;
      if (batch->waits) ready->acquire();
    }
    if (watch.ok()) registry.feed().Close(*watch);
    return events;
  };
  using Events = std::vector<std::pair<std::string, bool>>;
  EXPECT_EQ(reported(0), (Events{{"a", true}, {"d", true}}));
  EXPECT_EQ(reported(0, true), (Events{{"a", true}, {"b", true}, {"d", true}}));
  EXPECT_EQ(reported(before), (Events{{"c", false}, {"b", false}, {"a", true}}));
  EXPECT_EQ(reported(before, true), (Events{{"c", false}, {"a", true}, {"b", true}}));
}

}  // namespace postgres_records_test
}  // namespace hulld::server
