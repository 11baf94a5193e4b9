// Lists over a store that supports record lookup: every later read agrees with a list.
#include <absl/status/status.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <future>
#include <map>
#include <mutex>
#include <string>

#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace registry_listing_test {

// Keeps records. A committed batch may be held before the registry is notified.
class ListedStore : public MemoryStore {
 public:
  bool keeps_hulls() const override { return true; }
  bool supports_lookup() const override { return true; }
  absl::Status Commit(std::span<Change* const> changes) override {
    std::unique_lock lock(mutex_);
    const absl::Status committed = MemoryStore::Commit(changes);
    for (const Change* change : changes) records_[change->id()] = change->hull;
    ++commits_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !is_held_; });
    return committed;
  }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override {
    const std::lock_guard lock(mutex_);
    FoundRecords found;
    found.revision = revision();
    for (const std::string& id : ids) {
      const auto record = records_.find(id);
      if (record != records_.end()) found.hulls.emplace(id, record->second);
    }
    return found;
  }
  absl::StatusOr<FoundRecords> ListRecords(const std::string&, const std::string& after, size_t,
                                           RecordKinds) override {
    const std::lock_guard lock(mutex_);
    FoundRecords found;
    found.revision = revision();
    for (const auto& [id, record] : records_) {
      if (id > after) found.hulls.emplace(id, record);
    }
    return found;
  }

  void Hold(bool is_held) {
    const std::lock_guard lock(mutex_);
    is_held_ = is_held;
    changed_.notify_all();
  }
  uint64_t commits() {
    const std::lock_guard lock(mutex_);
    return commits_;
  }
  void AwaitCommit(uint64_t number) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return commits_ >= number; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, StoredHull> records_;
  uint64_t commits_ = 0;
  bool is_held_ = false;
};

// Interior points take no revision, so the revision alone does not identify the committed state.
TEST(RegistryListing, InsidePointsInFlightAreSeenByAllReadsOrNone) {
  TestRegistry<ListedStore> hulls(std::make_unique<ListedStore>());
  Registry& registry = hulls.registry();
  ASSERT_TRUE(hulls.Put("h", CubeCorners()).ok());
  ListedStore& store = hulls.store();
  const absl::StatusOr<OpenResult> writer = hulls.Open("h");
  ASSERT_TRUE(writer.ok());
  store.Hold(true);
  const uint64_t commits = store.commits();
  auto appended = std::async(std::launch::async, [&] {
    return hulls.Append(writer->session, writer->last_sequence + 1, {{0.5, 0.5, 0.5}});
  });
  store.AwaitCommit(commits + 1);
  // A listing may wait until the registry is notified.
  const auto release = [&] {
    store.Hold(false);
    return false;
  };
  const absl::StatusOr<RecordPage> page = registry.records().List("", "", 10, release);
  const absl::StatusOr<HullView> view = hulls.View("h");
  store.Hold(false);
  ASSERT_TRUE(page.ok() && view.ok());
  ASSERT_EQ(page->entries.size(), 1);
  EXPECT_LE(page->entries[0].record.counts.received, view->record.counts.received);
  EXPECT_TRUE(appended.get().ok());
  hulls.registry().changes().CloseAppend(writer->session);
}

}  // namespace registry_listing_test
}  // namespace hulld::server
