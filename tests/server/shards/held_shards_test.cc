// Reads of two shards that other servers change all the time, over two databases of PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/process/worker_pool.h"
#include "server/shards/shards.h"
#include "server/store/postgres/postgres_store.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace {

// One hulld: slots go to the two databases in turn.
class Server {
 public:
  explicit Server(const std::vector<std::string>& databases) {
    std::vector<Store*> stores;
    for (const std::string& database : databases) {
      PostgresOptions options;
      options.shared = true;
      options.conninfo = PostgresCluster::Shared().Conninfo(
          database, PostgresCluster::Shared().socket_directory());
      absl::StatusOr<std::unique_ptr<PostgresStore>> store = PostgresStore::Open(options);
      if (!store.ok()) {
        ADD_FAILURE() << store.status();
        std::abort();
      }
      stores_.push_back(*std::move(store));
      stores.push_back(stores_.back().get());
    }
    Shards::ShardOfSlot shard_of_slot{};
    for (size_t slot = 0; slot < kSlots; ++slot) {
      shard_of_slot[slot] = static_cast<uint16_t>(slot % 2);
    }
    shards_ = std::make_unique<Shards>(stores, shard_of_slot, Limits(), writers_);
    EXPECT_TRUE(shards_->Load().ok());
  }

  Shards& shards() { return *shards_; }
  std::string IdIn(size_t shard) const {
    for (int i = 0;; ++i) {
      std::string id = "hull" + std::to_string(i);
      if (shards_->shard_of(id) == shard) return id;
    }
  }
  // Puts a hull in its place of which `number` points were received.
  void Replace(const std::string& id, uint64_t number) {
    Replacement replacement;
    replacement.hull_id = id;
    replacement.create_if_absent = true;
    replacement.builder = std::make_shared<HullBuilder>();
    replacement.counts = *replacement.builder->Add(CubeCorners());
    replacement.counts.received = number;
    const auto replaced = MemoryRegistry::Wait<ReplaceResult>([&](Reply<ReplaceResult> done) {
      shards_->of(id).Replace(std::move(replacement), std::move(done));
    });
    EXPECT_TRUE(replaced.ok()) << replaced.status();
  }

 private:
  WorkerPool writers_{2};
  std::vector<std::unique_ptr<PostgresStore>> stores_;
  std::unique_ptr<Shards> shards_;
};

// The writer counts, first in the one hull and then in the other, so at every instant both say the
// same or the first is one ahead. Between any two looks it gets on by several steps, if it can:
// only where a shard is held does it not.
TEST(HeldShards, APairThatNeverStandsStillIsAnsweredAsItWasAtAnInstant) {
  if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
  const std::vector<std::string> databases = {PostgresCluster::Shared().MakeDatabase(),
                                              PostgresCluster::Shared().MakeDatabase()};
  Server writer(databases);
  Server reader(databases);
  const std::string ids[] = {writer.IdIn(0), writer.IdIn(1)};
  std::atomic<uint64_t> steps = 0;
  std::atomic<bool> is_over = false;
  const auto write = [&](uint64_t number) {
    for (const std::string& id : ids) {
      writer.Replace(id, number);
      ++steps;
    }
  };
  write(1);
  std::future<void> writing = std::async(std::launch::async, [&] {
    for (uint64_t number = 2; !is_over; ++number) write(number);
  });
  reader.shards().OnPart([&] {
    const uint64_t enough = steps + 3;
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(60);
    while (steps < enough && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  });
  for (int i = 0; i < 4; ++i) {
    KnownInShards known;
    const size_t first = i % 2;
    const std::vector<std::string> asked = {ids[first], ids[1 - first]};
    const auto resolved = reader.shards().Refresh(asked, known, {}, {});
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    const uint64_t a = resolved->hulls[first]->record.counts.received;
    const uint64_t b = resolved->hulls[1 - first]->record.counts.received;
    EXPECT_TRUE(a == b || a == b + 1) << a << " " << b;
  }
  is_over = true;
  writing.wait();
  EXPECT_GE(reader.shards().Commits().holds, 2);
}

}  // namespace
}  // namespace hulld::server
