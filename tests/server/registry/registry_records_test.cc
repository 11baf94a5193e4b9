// Requests of a registry to a store that supports record lookup: none at the start, and one per
// record while it is cached.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <semaphore>
#include <string>
#include <vector>

#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/store/memory_store.h"

namespace hulld::server {
namespace registry_records_test {

// Holds any number of empty hulls, "h" and a number each, and of bodies, "b" and a number.
class VastStore : public MemoryStore {
 public:
  static constexpr uint64_t kHulls = uint64_t{1} << 40;
  static constexpr uint64_t kBodies = uint64_t{1} << 39;

  bool keeps_hulls() const override { return true; }
  bool supports_lookup() const override { return true; }
  uint64_t revision() const override { return kHulls; }
  StoreTotals totals() const override { return {kHulls, 0, kBodies}; }
  absl::Status ForEachRecord(const StoredHullVisitor&, const StoredBodyVisitor&) override {
    ADD_FAILURE() << "all records are read";
    return absl::OkStatus();
  }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override {
    ++queries;
    records += ids.size();
    if (is_gone) return absl::UnavailableError("the store cannot be queried");
    FoundRecords found;
    found.revision = kHulls;
    for (const std::string& id : ids) {
      if (id.starts_with("h")) found.hulls.emplace(id, HullOf(id));
      if (id.starts_with("b")) found.bodies.emplace(id, BodyOf(id));
    }
    return found;
  }
  // Returns at most eight, even if more are requested.
  absl::StatusOr<FoundRecords> ListRecords(const std::string& prefix, const std::string& after,
                                           size_t limit, RecordKinds kinds) override {
    EXPECT_TRUE(kinds.bodies && !kinds.hulls);
    ++queries;
    FoundRecords found;
    found.revision = kHulls;
    found.more = true;
    const uint64_t first = after.empty() ? 10 : std::stoull(after.substr(1)) + 1;
    for (uint64_t i = 0; i < std::min<uint64_t>(limit, 8); ++i) {
      const std::string id = absl::StrCat(prefix, first + i);
      found.bodies.emplace(id, BodyOf(id));
    }
    return found;
  }

  std::atomic<uint64_t> queries = 0;
  std::atomic<uint64_t> records = 0;
  std::atomic<bool> is_gone = false;
  // Number of pieces of each body.
  size_t pieces = 1;

 private:
  StoredBody BodyOf(const std::string& id) const {
    StoredBody body;
    body.record = {id, 1, std::stoull(id.substr(1)) + 1};
    body.hull_ids = {"h1"};
    body.pieces.assign(pieces, StoredPiece());
    return body;
  }
  static StoredHull HullOf(const std::string& id) {
    StoredHull hull;
    hull.record.hull_id = id;
    hull.record.create_revision = hull.record.revision = std::stoull(id.substr(1)) + 1;
    return hull;
  }
};

class RegistryRecords : public ::testing::Test {
 protected:
  void Start(size_t limit) {
    registry_.SetRecordCapacity(limit);
    ASSERT_TRUE(registry_.Load().ok());
  }
  static std::vector<std::string> Ids(uint64_t first, uint64_t count, const char* kind = "h") {
    std::vector<std::string> ids;
    for (uint64_t i = 0; i < count; ++i) ids.push_back(absl::StrCat(kind, first + i));
    return ids;
  }
  void ExpectBodies(const std::vector<std::string>& ids) {
    const FoundBodies found = registry_.records().FindBodies(ids);
    ASSERT_TRUE(found.status.ok()) << found.status;
    ASSERT_EQ(found.bodies.size(), ids.size());
    for (size_t i = 0; i < ids.size(); ++i) {
      ASSERT_NE(found.bodies[i], nullptr) << ids[i];
      EXPECT_EQ(found.bodies[i]->record().body_id, ids[i]);
    }
  }
  void ExpectThere(const std::vector<std::string>& ids) {
    const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, {});
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    for (size_t i = 0; i < ids.size(); ++i) {
      ASSERT_TRUE(resolved->hulls[i].ok()) << resolved->hulls[i].status();
      EXPECT_EQ(resolved->hulls[i]->record.hull_id, ids[i]);
    }
  }

  VastStore store_;
  TaskPool writers_{1};
  Limits limits_ = [] {
    Limits limits;
    limits.memory_limit = 1 << 30;
    return limits;
  }();
  Registry registry_{store_, limits_, writers_};
};

TEST_F(RegistryRecords, StartupReadsNoRecords) {
  Start(1000);
  EXPECT_EQ(store_.queries, 0);
  EXPECT_EQ(registry_.Sizes().hull_count, VastStore::kHulls);
  EXPECT_EQ(registry_.Sizes().body_count, VastStore::kBodies);
  EXPECT_TRUE(registry_.has_bodies());
}

TEST_F(RegistryRecords, EachIsReadOnceAndManyAtATime) {
  Start(1000);
  ExpectThere(Ids(0, 512));
  EXPECT_EQ(store_.records, 512);
  EXPECT_LE(store_.queries, 5);
  const uint64_t queries = store_.queries;
  ExpectThere(Ids(0, 512));
  EXPECT_EQ(store_.queries, queries);
}

TEST_F(RegistryRecords, MissingRecordsAreCached) {
  Start(1000);
  const std::vector<std::string> ids = {"none"};
  for (int i = 0; i < 3; ++i) {
    const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, {});
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    EXPECT_TRUE(absl::IsNotFound(resolved->hulls[0].status()));
  }
  EXPECT_EQ(store_.records, 1);
}

TEST_F(RegistryRecords, NonblockingReadsFailUntilTheRecordIsKnown) {
  Start(1000);
  const std::vector<std::string> ids = {"h1"};
  EXPECT_FALSE(registry_.Resolve(ids, {}, {.may_wait = false}).ok());
  EXPECT_EQ(store_.queries, 0);
  ExpectThere(ids);
  EXPECT_TRUE(registry_.Resolve(ids, {}, {.may_wait = false}).ok());
}

// Records requested later replace earlier ones.
TEST_F(RegistryRecords, TheCacheStaysWithinItsLimit) {
  Start(200);
  for (uint64_t first = 0; first < 20'000; first += 100) ExpectThere(Ids(first, 100));
  const uint64_t records = store_.records;
  ExpectThere(Ids(0, 100));
  EXPECT_EQ(store_.records, records + 100);
  // Recent ones stay.
  const uint64_t again = store_.records;
  ExpectThere(Ids(0, 100));
  EXPECT_EQ(store_.records, again);
}

// A call may name more records than the cache holds.
TEST_F(RegistryRecords, ACallMayNameMoreRecordsThanTheCacheHolds) {
  Start(10);
  ExpectThere(Ids(0, 3000));
}

TEST_F(RegistryRecords, BodiesAreReadOnceAndManyAtATime) {
  Start(1000);
  ExpectBodies(Ids(0, 512, "b"));
  EXPECT_EQ(store_.records, 512);
  EXPECT_EQ(store_.queries, 4);
  ExpectBodies(Ids(0, 512, "b"));
  EXPECT_EQ(store_.queries, 4);
}

// A caller that looks for bodies among hulls learns the kind of every ID in one request.
TEST_F(RegistryRecords, MissingBodiesAreCached) {
  Start(1000);
  const std::vector<std::string> ids = {"h1", "b2", "none"};
  EXPECT_FALSE(registry_.records().FindBodies(ids, {}, false).status.ok());
  EXPECT_EQ(store_.queries, 0);
  const FoundBodies found = registry_.records().FindBodies(ids);
  ASSERT_TRUE(found.status.ok()) << found.status;
  EXPECT_EQ(found.bodies[0], nullptr);
  EXPECT_NE(found.bodies[1], nullptr);
  EXPECT_EQ(found.bodies[2], nullptr);
  EXPECT_EQ(store_.queries, 1);
  EXPECT_TRUE(registry_.records().FindBodies(ids, {}, false).status.ok());
  const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, {});
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_TRUE(resolved->hulls[0].ok());
  EXPECT_TRUE(absl::IsNotFound(resolved->hulls[1].status()));
  EXPECT_TRUE(absl::IsNotFound(resolved->hulls[2].status()));
  EXPECT_EQ(store_.records, 3);
}

TEST_F(RegistryRecords, UnusedBodiesAreBoundedInBytes) {
  Start(100);
  const uint64_t before = registry_.Cache().bytes;
  for (uint64_t first = 0; first < 20'000; first += 100) ExpectBodies(Ids(first, 100, "b"));
  EXPECT_LE(registry_.Cache().bytes - before, 400 * BodyTable::kBytesOfEntry);
  const uint64_t records = store_.records;
  // Recent ones are cached, earlier ones are not.
  ExpectBodies({"b19999"});
  EXPECT_EQ(store_.records, records);
  ExpectBodies({"b0"});
  EXPECT_EQ(store_.records, records + 1);
  // The cache holds fewer large bodies.
  store_.pieces = 10'000;
  for (uint64_t i = 0; i < 50; ++i) ExpectBodies({absl::StrCat("b", 30'000 + i)});
  EXPECT_LE(registry_.Cache().bytes - before, 2 * 10'000 * sizeof(StoredPiece));
}

// Otherwise it would be in memory twice.
TEST_F(RegistryRecords, ABodyInUseStaysCached) {
  Start(1);
  const std::vector<std::string> ids = {"b7"};
  const FoundBodies held = registry_.records().FindBodies(ids);
  for (uint64_t first = 100; first < 1000; first += 10) ExpectBodies(Ids(first, 10, "b"));
  EXPECT_EQ(registry_.records().FindBodies(ids).bodies.front(), held.bodies.front());
}

TEST_F(RegistryRecords, ACallMayNameMoreBodiesThanTheCacheHolds) {
  Start(10);
  ExpectBodies(Ids(0, 3000, "b"));
}

TEST_F(RegistryRecords, UnreadableBodiesReportTheCause) {
  Start(1000);
  ExpectBodies({"b1"});
  store_.is_gone = true;
  const std::vector<std::string> ids = {"b1", "b2"};
  const FoundBodies found = registry_.records().FindBodies(ids);
  EXPECT_TRUE(absl::IsUnavailable(found.status)) << found.status;
  EXPECT_NE(found.bodies[0], nullptr);
  EXPECT_EQ(found.bodies[1], nullptr);
  store_.is_gone = false;
  ExpectBodies(ids);
}

TEST_F(RegistryRecords, BodiesAreListedPageByPageWithoutBeingKept) {
  Start(1000);
  std::string after;
  for (int i = 0; i < 10; ++i) {
    const absl::StatusOr<RecordPage> page =
        registry_.records().List("b", after, 5, {}, {.bodies = true});
    ASSERT_TRUE(page.ok()) << page.status();
    ASSERT_EQ(page->entries.size(), 5);
    EXPECT_TRUE(page->more);
    after = page->entries.back().record.hull_id;
  }
  EXPECT_EQ(after, "b59");
  EXPECT_EQ(store_.queries, 10);
  EXPECT_FALSE(registry_.records().FindBodies(Ids(10, 1, "b"), {}, false).status.ok());
}

// The batch that reports the restart does not wait, although the existing hulls are not read yet.
TEST_F(RegistryRecords, AWatchThatCannotResumeReportsThatItRestarted) {
  Start(10);
  ChangeFeed& feed = registry_.feed();
  std::counting_semaphore<> ready(0);
  const auto watch = *feed.Open({"", {"h7"}}, {1, "another store"}, [&ready] { ready.release(); });
  WatchBatch batch = *feed.Next(watch);
  while (batch.waits) {
    ready.acquire();
    batch = *feed.Next(watch);
  }
  EXPECT_TRUE(batch.restarted);
  ASSERT_EQ(batch.changes.size(), 1);
  EXPECT_EQ(batch.changes[0].record.hull_id, "h7");
  feed.Close(watch);
}

}  // namespace registry_records_test
}  // namespace hulld::server
