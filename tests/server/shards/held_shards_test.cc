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
    const std::vector<WorkerPool*> writers(stores.size(), &writers_);
    shards_ = std::make_unique<Shards>(stores, shard_of_slot, Limits(), writers);
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

// A writer counts, first in the one hull and then in the other, so at every instant both say the
// same or the first is one ahead. Between any two looks of a reader it gets on by several steps, if
// it can: only where a shard is held does it not.
class HeldShards : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
    databases_ = {PostgresCluster::Shared().MakeDatabase(),
                  PostgresCluster::Shared().MakeDatabase()};
    writer_ = std::make_unique<Server>(databases_);
    reader_ = std::make_unique<Server>(databases_);
    ids_ = {writer_->IdIn(0), writer_->IdIn(1)};
    Write(1);
    writing_ = std::async(std::launch::async, [this] {
      for (uint64_t number = 2; !is_over_; ++number) Write(number);
    });
  }
  void TearDown() override {
    is_over_ = true;
    if (writing_.valid()) writing_.wait();
  }

  void Write(uint64_t number) {
    for (const std::string& id : ids_) {
      writer_->Replace(id, number);
      ++steps_;
    }
  }
  void LetTheWriterGoOn() const {
    const uint64_t enough = steps_ + 3;
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(60);
    while (steps_ < enough && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  }
  void ExpectAPairOfOneInstant(size_t first) {
    KnownInShards known;
    const std::vector<std::string> asked = {ids_[first], ids_[1 - first]};
    const auto resolved = reader_->shards().Refresh(asked, known, {}, {});
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    const uint64_t a = resolved->hulls[first]->record.counts.received;
    const uint64_t b = resolved->hulls[1 - first]->record.counts.received;
    EXPECT_TRUE(a == b || a == b + 1) << a << " " << b;
  }
  uint64_t holds() const { return reader_->shards().Commits().holds; }

  std::vector<std::string> databases_;
  std::unique_ptr<Server> writer_;
  std::unique_ptr<Server> reader_;
  std::vector<std::string> ids_;
  std::atomic<uint64_t> steps_ = 0;
  std::atomic<bool> is_over_ = false;
  std::future<void> writing_;
};

TEST_F(HeldShards, APairThatNeverStandsStillIsAnsweredAsItWasAtAnInstant) {
  reader_->shards().OnPart([this] { LetTheWriterGoOn(); });
  for (const size_t first : {0, 1, 0, 1}) ExpectAPairOfOneInstant(first);
  EXPECT_GE(holds(), 2);
}

// The database ends the session that holds the turn: others commit, and the reader holds again.
TEST_F(HeldShards, WhereTheTurnIsLostTheReaderLooksOn) {
  uint64_t lost = 0;
  reader_->shards().OnPart([this, &lost] {
    if (holds() > lost && lost < 2) {
      lost = holds();
      for (const std::string& database : databases_) {
        PostgresCluster::Shared().Ask(
            database,
            "SELECT pg_terminate_backend(a.pid) FROM pg_locks l JOIN pg_stat_activity a USING "
            "(pid) "
            "WHERE l.relation = 'hulld.store'::regclass AND l.mode = 'RowShareLock' AND l.granted "
            "AND a.state = 'idle in transaction' AND a.datname = current_database()");
      }
    }
    LetTheWriterGoOn();
  });
  for (const size_t first : {0, 1}) ExpectAPairOfOneInstant(first);
  EXPECT_GT(holds(), lost);
  EXPECT_GE(lost, 1);
}

}  // namespace
}  // namespace hulld::server
