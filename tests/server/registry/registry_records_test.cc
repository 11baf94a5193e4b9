// What a registry asks of a store that finds records: nothing at the start, and each record once
// while it is kept.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <vector>

#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/store/memory_store.h"

namespace hulld::server {
namespace {

// Holds any number of empty hulls, "h" and a number each.
class VastStore : public MemoryStore {
 public:
  static constexpr uint64_t kHulls = uint64_t{1} << 40;

  bool keeps_hulls() const override { return true; }
  bool finds_records() const override { return true; }
  uint64_t revision() const override { return kHulls; }
  StoreTotals totals() const override { return {kHulls, 0}; }
  absl::Status ForEachHull(const StoredHullVisitor&) override {
    ADD_FAILURE() << "all hulls are read";
    return absl::OkStatus();
  }
  absl::StatusOr<FoundHulls> FindHulls(std::span<const std::string> ids) override {
    ++questions;
    records += ids.size();
    FoundHulls found;
    found.revision = kHulls;
    for (const std::string& id : ids) {
      if (id.starts_with("h")) found.hulls.emplace(id, HullOf(id));
    }
    return found;
  }

  std::atomic<uint64_t> questions = 0;
  std::atomic<uint64_t> records = 0;

 private:
  static StoredHull HullOf(const std::string& id) {
    StoredHull hull;
    hull.record.hull_id = id;
    hull.record.create_revision = hull.record.revision = std::stoull(id.substr(1)) + 1;
    return hull;
  }
};

class RegistryRecords : public ::testing::Test {
 protected:
  void Start(size_t most) {
    registry_.KeepRecords(most);
    ASSERT_TRUE(registry_.Load().ok());
  }
  static std::vector<std::string> Ids(uint64_t first, uint64_t count) {
    std::vector<std::string> ids;
    for (uint64_t i = 0; i < count; ++i) ids.push_back(absl::StrCat("h", first + i));
    return ids;
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
  WorkerPool writers_{1};
  Limits limits_ = [] {
    Limits limits;
    limits.memory_limit = 1 << 30;
    return limits;
  }();
  Registry registry_{store_, limits_, writers_};
};

TEST_F(RegistryRecords, TheStartReadsNothing) {
  Start(1000);
  EXPECT_EQ(store_.questions, 0);
  EXPECT_EQ(registry_.Sizes().hull_count, VastStore::kHulls);
}

TEST_F(RegistryRecords, EachIsReadOnceAndManyAtATime) {
  Start(1000);
  ExpectThere(Ids(0, 512));
  EXPECT_EQ(store_.records, 512);
  EXPECT_LE(store_.questions, 5);
  const uint64_t questions = store_.questions;
  ExpectThere(Ids(0, 512));
  EXPECT_EQ(store_.questions, questions);
}

TEST_F(RegistryRecords, AlsoThatThereIsNothingIsKept) {
  Start(1000);
  const std::vector<std::string> ids = {"none"};
  for (int i = 0; i < 3; ++i) {
    const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, {});
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    EXPECT_TRUE(absl::IsNotFound(resolved->hulls[0].status()));
  }
  EXPECT_EQ(store_.records, 1);
}

TEST_F(RegistryRecords, WhoMayNotWaitIsNotAnsweredUntilItIsKnown) {
  Start(1000);
  const std::vector<std::string> ids = {"h1"};
  EXPECT_FALSE(registry_.TryResolve(ids).has_value());
  EXPECT_EQ(store_.questions, 0);
  ExpectThere(ids);
  EXPECT_TRUE(registry_.TryResolve(ids).has_value());
}

// What is asked for later takes the place of what was asked for before.
TEST_F(RegistryRecords, NoMoreAreKeptThanItIsTold) {
  Start(200);
  for (uint64_t first = 0; first < 20'000; first += 100) ExpectThere(Ids(first, 100));
  const uint64_t records = store_.records;
  ExpectThere(Ids(0, 100));
  EXPECT_EQ(store_.records, records + 100);
  // Those of now stay.
  const uint64_t again = store_.records;
  ExpectThere(Ids(0, 100));
  EXPECT_EQ(store_.records, again);
}

// A call that names more than are kept is answered all the same.
TEST_F(RegistryRecords, ACallMayNameMoreThanAreKept) {
  Start(10);
  ExpectThere(Ids(0, 3000));
}

}  // namespace
}  // namespace hulld::server
