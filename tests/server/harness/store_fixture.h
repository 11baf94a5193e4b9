#ifndef HULLD_TESTS_SERVER_HARNESS_STORE_FIXTURE_H_
#define HULLD_TESTS_SERVER_HARNESS_STORE_FIXTURE_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/store/memory_store.h"
#include "server/store/rocksdb_store.h"

namespace hulld::server {

// A registry over a store.
template <typename StoreType>
class TestRegistry {
 public:
  explicit TestRegistry(std::unique_ptr<StoreType> store, const Limits& limits = {})
      : store_(std::move(store)), registry_(*store_, limits, writers_) {
    loaded_ = registry_.Load();
  }

  StoreType& store() { return *store_; }
  Registry& registry() { return registry_; }
  const absl::Status& loaded() const { return loaded_; }

  // Waits for the reply of a call.
  template <typename T, typename Call>
  static absl::StatusOr<T> Wait(const Call& call) {
    std::promise<absl::StatusOr<T>> promise;
    call([&](absl::StatusOr<T> result) { promise.set_value(std::move(result)); });
    return promise.get_future().get();
  }

  absl::StatusOr<PutHullResult> Create(const std::string& id, bool if_absent = false) {
    return Wait<PutHullResult>(
        [&](const Reply<PutHullResult>& done) { registry_.changes().Create(id, if_absent, done); });
  }
  absl::StatusOr<uint64_t> Delete(const std::string& id) {
    return Wait<uint64_t>([&](const Reply<uint64_t>& done) {
      registry_.changes().Delete("hull", id, std::nullopt, done);
    });
  }
  absl::StatusOr<OpenResult> Open(const std::string& id, const std::string& writer = "w",
                                  bool create_if_absent = true) {
    return Wait<OpenResult>([&](Reply<OpenResult> done) {
      registry_.changes().OpenAppend(
          id, writer, create_if_absent, [](const absl::Status&) {}, std::move(done));
    });
  }
  absl::StatusOr<ChunkResult> Append(const AppendSession& session, uint64_t sequence,
                                     std::vector<Vector> points) {
    return Wait<ChunkResult>([&](Reply<ChunkResult> done) {
      registry_.changes().Append(session, {sequence, std::move(points), std::nullopt}, {}, {},
                                 std::move(done));
    });
  }
  // Sends one chunk in its own session.
  absl::StatusOr<ChunkResult> Put(const std::string& id, std::vector<Vector> points,
                                  const std::string& writer = "w") {
    const absl::StatusOr<OpenResult> opened = Open(id, writer);
    if (!opened.ok()) return opened.status();
    absl::StatusOr<ChunkResult> result =
        Append(opened->session, opened->last_sequence + 1, std::move(points));
    registry_.changes().CloseAppend(opened->session);
    return result;
  }
  absl::StatusOr<PutHullResult> Replace(Replacement replacement) {
    return Wait<PutHullResult>([&](const Reply<PutHullResult>& done) {
      registry_.changes().Replace(std::move(replacement), done);
    });
  }
  absl::StatusOr<HullView> View(const std::string& id) {
    auto resolved = registry_.Resolve(id, {});
    if (!resolved.ok()) return resolved.status();
    return resolved->second;
  }

 private:
  std::unique_ptr<StoreType> store_;
  TaskPool writers_{2};
  Registry registry_;
  absl::Status loaded_;
};

using DurableRegistry = TestRegistry<RocksDbStore>;
using MemoryRegistry = TestRegistry<MemoryStore>;

// Gives each test its own directory and opens stores in it.
class StoreTest : public ::testing::Test {
 protected:
  StoreTest() {
    std::string name = ::testing::TempDir() + "hulld_store_XXXXXX";
    directory_ = mkdtemp(name.data());
  }
  ~StoreTest() override { std::filesystem::remove_all(directory_); }

  absl::StatusOr<std::unique_ptr<RocksDbStore>> OpenStore(const std::string& name = "data") {
    RocksDbOptions options;
    options.data_dir = directory_ + "/" + name;
    options.durability = durability_;
    options.sync_interval = sync_interval_;
    options.reserve_bytes = reserve_bytes_;
    options.env = env_;
    return RocksDbStore::Open(options);
  }
  // Closes the open store and opens it again; this must succeed.
  DurableRegistry& Start(const Limits& limits = {}) {
    hulls_ = nullptr;
    absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore();
    if (!store.ok()) {
      ADD_FAILURE() << store.status();
      std::abort();
    }
    hulls_ = std::make_unique<DurableRegistry>(*std::move(store), limits);
    EXPECT_TRUE(hulls_->loaded().ok()) << hulls_->loaded();
    return *hulls_;
  }

  std::string directory_;
  Durability durability_ = Durability::kSync;
  std::chrono::milliseconds sync_interval_{1};
  uint64_t reserve_bytes_ = 1 << 20;
  rocksdb::Env* env_ = nullptr;
  std::unique_ptr<DurableRegistry> hulls_;
};

// Returns the canonical snapshot of a resolved hull, which must be undamaged; valid as long as
// view.served.
const Hull& CanonicalOf(const HullView& view);
// Returns the corners of the cube [low, low + size]^3.
std::vector<Vector> CubeCorners(double low = 0, double size = 1);
// Returns `count` points on the unit sphere, all extreme.
std::vector<Vector> SpherePoints(int count, double radius = 1);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_STORE_FIXTURE_H_
