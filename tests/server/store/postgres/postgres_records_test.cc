// Records are looked up, not read at the start; and what the store holds is counted with each
// batch.
#include <absl/strings/str_cat.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <semaphore>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/store/postgres/postgres_fixture.h"

namespace hulld::server {
namespace {

class PostgresRecords : public PostgresTest {
 protected:
  // As the database counts them.
  std::string Counted() const { return Ask("SELECT count(*) FROM hulld.hulls").front(); }
  std::string Kept() const { return Ask("SELECT hulls FROM hulld.store").front(); }
  uint64_t KeptVertices() const {
    return std::stoull(Ask("SELECT vertices FROM hulld.store").front());
  }
  static uint64_t ResidentPages() {
    std::ifstream file("/proc/self/statm");
    uint64_t size = 0;
    uint64_t resident = 0;
    file >> size >> resident;
    return resident;
  }
  // Hulls of 8 vertices, and one that is gone.
  void FillSome() {
    ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
    ASSERT_TRUE(hulls_->Put("b", CubeCorners()).ok());
    ASSERT_TRUE(hulls_->Create("c").ok());
    ASSERT_TRUE(hulls_->Put("gone", CubeCorners()).ok());
    ASSERT_TRUE(hulls_->Delete("gone").ok());
  }
};

TEST_F(PostgresRecords, NoRecordIsReadUntilItIsAskedFor) {
  Start();
  FillSome();
  Ask("UPDATE hulld.hulls SET record = '\\x00' WHERE hull_id = 'b'");
  Start();
  EXPECT_EQ(hulls_->registry().Cache().damaged, 0);
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, 3);
  EXPECT_TRUE(hulls_->View("a").ok());
  EXPECT_TRUE(absl::IsNotFound(hulls_->View("gone").status()));
  EXPECT_EQ(hulls_->registry().Cache().damaged, 0);
  EXPECT_TRUE(absl::IsDataLoss(hulls_->View("b").status()));
  EXPECT_EQ(hulls_->registry().Cache().damaged, 1);
}

// What was found may be of a moment after which the registry has not heard of its own commit yet:
// then it waits for its committer, which follows, also where nobody else commits.
TEST_F(PostgresRecords, AServerThatIsActiveAloneHasNobodyToFollow) {
  const auto store = Open();
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_FALSE((*store)->is_shared());
  EXPECT_TRUE((*store)->Follow().ok()) << (*store)->Follow();
}

TEST_F(PostgresRecords, APrefixThatNoIdHasListsNothing) {
  Start();
  FillSome();
  for (const std::string& prefix : {std::string("a\0", 2), std::string("\xff\xfe"),
                                    std::string("\xc3\xa9"), std::string("a b")}) {
    const auto page = hulls_->registry().List(prefix, "", 10, {});
    ASSERT_TRUE(page.ok()) << page.status();
    EXPECT_TRUE(page->hulls.empty());
  }
  EXPECT_EQ(hulls_->store().failures().read, 0);
}

TEST_F(PostgresRecords, WhatThereIsIsCountedWithEachBatch) {
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
  // The other server is told how many there are, without having asked for any.
  const std::unique_ptr<PostgresRegistry> other = MakeRegistry();
  ASSERT_TRUE(hulls_->Delete("a").ok());
  ASSERT_TRUE(hulls_->Put("b", {{9, 9, 9}}, "other").ok());
  ASSERT_TRUE(other->registry().AwaitOthers({}).ok());
  EXPECT_EQ(other->registry().Sizes().hull_count, 2);
  EXPECT_EQ(other->registry().Sizes().vertex_count, hulls_->registry().Sizes().vertex_count);
  EXPECT_EQ(KeptVertices(), hulls_->registry().Sizes().vertex_count);
  EXPECT_EQ(Kept(), Counted());
}

TEST_F(PostgresRecords, TablesOfFormerFormatsAreCountedOnce) {
  for (const bool shared : {false, true}) {
    SCOPED_TRACE(shared);
    options_.shared = shared;
    Start();
    if (!shared) FillSome();
    hulls_ = nullptr;
    Ask("ALTER TABLE hulld.store DROP COLUMN hulls, DROP COLUMN vertices");
    Ask("ALTER TABLE IF EXISTS hulld.changes DROP COLUMN began");
    Ask("UPDATE hulld.store SET format = 1");
    const std::string epoch = Ask("SELECT epoch FROM hulld.store").front();
    // A server that is refused leaves it to those that are active.
    options_.slots = "0-511";
    EXPECT_TRUE(absl::IsFailedPrecondition(Open().status()));
    options_.slots.clear();
    EXPECT_EQ(Ask("SELECT format FROM hulld.store").front(), "1");
    EXPECT_EQ(Ask("SELECT epoch FROM hulld.store").front(), epoch);
    Start();
    EXPECT_EQ(hulls_->registry().Sizes().hull_count, 3);
    EXPECT_EQ(hulls_->registry().Sizes().vertex_count, 16);
    EXPECT_EQ(Ask("SELECT format FROM hulld.store").front(), "3");
    EXPECT_NE(Ask("SELECT epoch FROM hulld.store").front(), epoch);
    EXPECT_TRUE(hulls_->View("a").ok());
    ASSERT_TRUE(hulls_->Create("d").ok());
    ASSERT_TRUE(hulls_->Delete("d").ok());
    EXPECT_EQ(Kept(), Counted());
  }
}

TEST_F(PostgresRecords, AServerThatIsToldToEndLeavesTablesAsTheyWere) {
  Start();
  FillSome();
  hulls_ = nullptr;
  Ask("ALTER TABLE hulld.store DROP COLUMN hulls, DROP COLUMN vertices");
  Ask("UPDATE hulld.store SET format = 1");
  options_.should_stop = [] { return true; };
  EXPECT_TRUE(absl::IsCancelled(Open().status()));
  EXPECT_EQ(Ask("SELECT format FROM hulld.store").front(), "1");
  options_.should_stop = {};
  Start();
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, 3);
}

// As while another server counts what tables of a former format hold.
TEST_F(PostgresRecords, AServerWaitsWhileAnotherChangesTheTables) {
  Start();
  FillSome();
  hulls_ = nullptr;
  options_.lock_time = std::chrono::milliseconds(10);
  for (const bool shared : {false, true}) {
    SCOPED_TRACE(shared);
    options_.shared = shared;
    auto other = Session::Open(*Conninfo::Parse(options_.conninfo), std::chrono::minutes(1));
    ASSERT_TRUE(other.ok()) << other.status();
    ASSERT_TRUE((*other)->Run("BEGIN; LOCK TABLE hulld.store IN ACCESS EXCLUSIVE MODE").ok());
    options_.should_stop = [] { return true; };
    EXPECT_TRUE(absl::IsCancelled(Open().status()));
    options_.should_stop = [&] { return !(*other)->Run("COMMIT").ok(); };
    Start();
    EXPECT_EQ(hulls_->registry().Sizes().hull_count, 3);
  }
}

// HULLD_RECORDS in the environment: how many, by hand; it prints what a start takes, and what
// reading all of them would.
TEST_F(PostgresRecords, AServerStartsOverManyHulls) {
  const char* const wanted = std::getenv("HULLD_RECORDS");
  const uint64_t count = wanted == nullptr ? 20'000 : std::stoull(wanted);
  {
    const auto store = Open();
    ASSERT_TRUE(store.ok()) << store.status();
    for (uint64_t first = 0; first < count; first += 5000) {
      std::vector<Change> changes(std::min<uint64_t>(5000, count - first));
      std::vector<Change*> pointers;
      for (Change& change : changes) {
        change.begins = true;
        change.hull.record.hull_id = absl::StrCat("hull-", first + pointers.size());
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
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, count);
  EXPECT_TRUE(hulls_->View(absl::StrCat("hull-", count - 1)).ok());
  const double taken = seconds_since(start);
  const uint64_t resident = ResidentPages() - resident_before;
  const Clock::time_point all_start = Clock::now();
  std::map<std::string, StoredHull> all;
  const absl::Status read = hulls_->store().ForEachHull(
      [&](const std::string& id, absl::StatusOr<StoredHull> hull) { all.emplace(id, *hull); });
  ASSERT_TRUE(read.ok()) << read;
  EXPECT_EQ(all.size(), count);
  if (wanted == nullptr) return;
  std::cout << count << " hulls: " << taken << " s and " << resident * 4 / 1024
            << " MiB to the first answer; to read all of them " << seconds_since(all_start)
            << " s, and " << (ResidentPages() - resident_before) * 4 / 1024 << " MiB with them\n";
}

TEST_F(PostgresRecords, AListIsReadPageByPage) {
  Start();
  FillSome();
  Start();
  std::vector<std::string> listed;
  for (std::string after;;) {
    const absl::StatusOr<HullPage> page = hulls_->registry().List("", after, 1);
    ASSERT_TRUE(page.ok()) << page.status();
    ASSERT_EQ(page->hulls.size(), 1);
    after = page->hulls.front().record.hull_id;
    listed.push_back(after);
    if (!page->more) break;
  }
  EXPECT_EQ(listed, (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_FALSE(hulls_->registry().List("b", "", 10)->more);
  EXPECT_EQ(hulls_->registry().List("b", "", 10)->hulls.size(), 1);
  EXPECT_TRUE(hulls_->registry().List("", "c", 10)->hulls.empty());
}

// One that is not in memory, and one of which is known that it went, which came again since.
TEST_F(PostgresRecords, AWatchIsToldWhatIsThereAndWhatWent) {
  Start();
  FillSome();
  Registry& registry = hulls_->registry();
  registry.KeepRecords(0);
  const uint64_t before = registry.Sizes().store_revision;
  ASSERT_TRUE(hulls_->Delete("a").ok());
  ASSERT_TRUE(hulls_->Delete("c").ok());
  ASSERT_TRUE(hulls_->Create("a").ok());
  // What is known of them goes.
  for (int i = 0; i < 100; ++i) hulls_->View(absl::StrCat("none-", i)).IgnoreError();
  const auto told = [&](uint64_t after) {
    std::vector<std::pair<std::string, bool>> events;
    const auto ready = std::make_shared<std::counting_semaphore<>>(0);
    const auto watch = registry.OpenWatch(
        {}, {.tell_present = true, .after_revision = after, .store_id = hulls_->store().id()},
        [ready] { ready->release(); });
    EXPECT_TRUE(watch.ok()) << watch.status();
    for (bool is_synced = !watch.ok(); !is_synced;) {
      const absl::StatusOr<WatchPiece> piece = registry.TakeChanges(**watch);
      EXPECT_TRUE(piece.ok()) << piece.status();
      if (!piece.ok()) break;
      for (const HullChange& change : piece->changes) {
        events.emplace_back(change.record.hull_id, change.kind != ChangeKind::kDeleted);
      }
      is_synced = piece->synced;
      if (piece->waits) ready->acquire();
    }
    if (watch.ok()) registry.CloseWatch(*watch);
    return events;
  };
  using Events = std::vector<std::pair<std::string, bool>>;
  EXPECT_EQ(told(0), (Events{{"a", true}, {"b", true}}));
  EXPECT_EQ(told(before), (Events{{"c", false}, {"a", true}}));
}

}  // namespace
}  // namespace hulld::server
