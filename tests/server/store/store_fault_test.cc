// Disk errors, full disks, and power failures while hulls grow.

#include <absl/strings/str_cat.h>
#include <rocksdb/env.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <semaphore>
#include <thread>

#include "core/hull/audit.h"
#include "tests/server/harness/faulty_file_system.h"
#include "tests/server/harness/store_fixture.h"
#include "tests/test_size.h"

namespace hulld::server {
namespace store_fault_test {

using ::testing::HasSubstr;
using Fault = FaultyFileSystem::Fault;

class StoreFault : public StoreTest {
 protected:
  StoreFault() { env_ = faulty_env_.get(); }
  ~StoreFault() override { hulls_ = nullptr; }

  void ExpectRefusedThenWell(Fault fault, absl::StatusCode code, const std::string& cause) {
    Start();
    ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
    ASSERT_TRUE(hulls_->Put("cold", CubeCorners()).ok());
    Start();
    const HullView before = *hulls_->View("h");
    const uint64_t revision = hulls_->registry().Sizes().store_revision;
    const AppendSession session = hulls_->Open("h")->session;
    for (int round = 0; round < 3; ++round) {
      files_->SetFault(fault);
      for (int attempt = 0; attempt < 3; ++attempt) {
        const auto refused = hulls_->Append(session, 2, {{9, 9, 9}});
        EXPECT_EQ(refused.status().code(), code) << refused.status();
        EXPECT_THAT(std::string(refused.status().message()), HasSubstr(cause));
        EXPECT_FALSE(hulls_->Create("new").ok());
        EXPECT_FALSE(hulls_->Delete("h").ok());
        EXPECT_FALSE(hulls_->Replace({"h", {}, false, std::make_shared<HullBuilder>(), {}}).ok());
        // Queries continue, for hulls in memory and for evicted ones.
        EXPECT_EQ(hulls_->View("h")->record, before.record);
        EXPECT_EQ(CanonicalOf(*hulls_->View("h")).vertices().size(), 8);
        EXPECT_EQ(hulls_->View("cold")->record.vertex_count, 8);
        EXPECT_EQ(hulls_->View("new").status().code(), absl::StatusCode::kNotFound);
        EXPECT_EQ(hulls_->registry().Sizes().store_revision, revision);
        EXPECT_EQ(hulls_->registry().Sizes().hull_count, 2);
      }
      files_->SetFault(Fault::kNone);
    }
    // Neither a restart nor a new stream is needed.
    const absl::StatusOr<ChunkResult> accepted = hulls_->Append(session, 2, {{9, 9, 9}});
    ASSERT_TRUE(accepted.ok()) << accepted.status();
    EXPECT_GT(accepted->hull_revision, revision);
    const HullView after = *hulls_->View("h");
    EXPECT_EQ(after.record.counts.received, 9);
    EXPECT_TRUE(AuditHull(CanonicalOf(after)).ok());
    Start();
    EXPECT_EQ(hulls_->View("h")->record, after.record);
  }

  // Returns the points received by hull "h", as stored in a directory.
  uint64_t ReceivedIn(const std::string& name) {
    rocksdb::Env* const faulty = std::exchange(env_, nullptr);
    absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore(name);
    env_ = faulty;
    EXPECT_TRUE(store.ok()) << store.status();
    if (!store.ok()) return 0;
    return DurableRegistry(*std::move(store)).View("h")->record.counts.received;
  }

  const std::shared_ptr<FaultyFileSystem> files_ = std::make_shared<FaultyFileSystem>();
  const std::unique_ptr<rocksdb::Env> faulty_env_ = rocksdb::NewCompositeEnv(files_);
};

TEST_F(StoreFault, AFullDiskRefusesOnlyChanges) {
  ExpectRefusedThenWell(Fault::kNoSpace, absl::StatusCode::kResourceExhausted, "is full");
}

TEST_F(StoreFault, AFailingDiskRefusesOnlyChanges) {
  ExpectRefusedThenWell(Fault::kIoError, absl::StatusCode::kUnavailable, "Input/output error");
}

TEST_F(StoreFault, AReadOnlyDiskRefusesOnlyChanges) {
  ExpectRefusedThenWell(Fault::kReadOnly, absl::StatusCode::kUnavailable, "Read-only file system");
}

TEST_F(StoreFault, UnsyncedChangesAreNotAcknowledged) {
  ExpectRefusedThenWell(Fault::kSyncError, absl::StatusCode::kUnavailable, "syncing");
}

// Each database counts only its own stalls.
TEST_F(StoreFault, StallCountsContinueAfterReopening) {
  Start();
  RocksDbStore& store = hulls_->store();
  // Makes a single uncompacted file a reason to stall.
  const auto stall = [&store] {
    EXPECT_TRUE(store.db()
                    .SetOptions({{"level0_file_num_compaction_trigger", "1"},
                                 {"level0_slowdown_writes_trigger", "1"}})
                    .ok());
    EXPECT_TRUE(store.db().Flush(rocksdb::FlushOptions()).ok());
    return store.disk()->stalls;
  };
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const uint64_t before = stall();
  ASSERT_GT(before, 0);
  files_->SetFault(Fault::kNoSpace);
  EXPECT_FALSE(hulls_->Create("refused").ok());
  files_->SetFault(Fault::kNone);
  ASSERT_TRUE(hulls_->Create("accepted").ok());
  const uint64_t after = store.disk()->stalls;
  EXPECT_GE(after, before);
  EXPECT_GT(stall(), after);
}

// Simulates a kill and a power failure after a refused change. The change must be absent if the
// error says that nothing was changed; otherwise the error says that it may appear.
TEST_F(StoreFault, FailedChangesAreNotFoundByTheNextProcess) {
  constexpr int64_t kForever = std::numeric_limits<int64_t>::max();
  struct Case {
    Fault fault;
    int64_t failures;
    absl::StatusCode code;
    bool is_certain;
  };
  std::mt19937_64 random(5);
  for (const Case& c : {Case{Fault::kNoSpace, kForever, absl::StatusCode::kResourceExhausted, true},
                        {Fault::kNoSpaceAtSync, 1, absl::StatusCode::kResourceExhausted, true},
                        {Fault::kNoSpaceAtSync, kForever, absl::StatusCode::kUnavailable, false},
                        {Fault::kSyncError, 1, absl::StatusCode::kUnavailable, true},
                        {Fault::kSyncError, kForever, absl::StatusCode::kUnavailable, false},
                        {Fault::kIoError, kForever, absl::StatusCode::kUnavailable, false}}) {
    SCOPED_TRACE(absl::StrCat("fault ", static_cast<int>(c.fault), ", failures ", c.failures));
    hulls_ = nullptr;
    std::filesystem::remove_all(directory_ + "/data");
    Start();
    ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
    const uint64_t syncs = hulls_->store().failures().sync;
    files_->SetFault(c.fault, c.failures);
    const absl::Status refused = hulls_->Put("h", {{9, 9, 9}}).status();
    EXPECT_EQ(refused.code(), c.code) << refused;
    EXPECT_THAT(std::string(refused.message()),
                HasSubstr(c.is_certain ? "nothing was changed" : "may appear"));
    const bool is_sync = c.fault == Fault::kNoSpaceAtSync || c.fault == Fault::kSyncError;
    EXPECT_EQ(hulls_->store().failures().sync - syncs, is_sync ? 1 : 0);
    for (const bool is_outage : {false, true}) {
      const std::string left = directory_ + "/left";
      std::filesystem::remove_all(left);
      if (is_outage) {
        files_->CopySurvivors(directory_ + "/data", left, random);
      } else {
        std::filesystem::copy(directory_ + "/data", left, std::filesystem::copy_options::recursive);
      }
      const uint64_t received = ReceivedIn("left");
      EXPECT_TRUE(received == 8 || (received == 9 && !c.is_certain)) << received;
    }
    // After the disk has recovered, the refused change is gone for good.
    files_->SetFault(Fault::kNone);
    ASSERT_TRUE(hulls_->Create("other").ok());
    std::filesystem::remove_all(directory_ + "/left");
    std::filesystem::copy(directory_ + "/data", directory_ + "/left",
                          std::filesystem::copy_options::recursive);
    EXPECT_EQ(ReceivedIn("left"), 8);
    ASSERT_TRUE(hulls_->Put("h", {{7, 7, 7}}).ok());
    EXPECT_EQ(hulls_->View("h")->served->high(), Vector(7, 7, 7));
  }
}

// An orderly end leaves no refused change behind.
TEST_F(StoreFault, RefusedChangesDoNotSurviveAShutdown) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  files_->SetFault(Fault::kNoSpaceAtSync);
  EXPECT_TRUE(absl::IsUnavailable(hulls_->Put("h", {{9, 9, 9}}).status()));
  files_->SetFault(Fault::kNone);
  Start();
  EXPECT_EQ(hulls_->View("h")->record.counts.received, 8);
}

TEST_F(StoreFault, FailuresAreCountedByKind) {
  struct Expected {
    Fault fault;
    uint64_t write;
    uint64_t sync;
  };
  for (const Expected& expected :
       {Expected{Fault::kIoError, 1, 0}, {Fault::kNoSpace, 1, 0}, {Fault::kSyncError, 0, 1}}) {
    // A new store has nothing to compact in the background.
    hulls_ = nullptr;
    std::filesystem::remove_all(directory_ + "/data");
    Start();
    ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
    EXPECT_EQ(hulls_->store().failures().write, 0);
    files_->SetFault(expected.fault);
    // The second attempt starts with a recovery of the store.
    for (uint64_t attempt = 1; attempt <= 2; ++attempt) {
      EXPECT_FALSE(hulls_->Create("new").ok());
      const StoreFailures failures = hulls_->store().failures();
      EXPECT_EQ(failures.write, expected.write * attempt);
      EXPECT_EQ(failures.sync, expected.sync * attempt);
      EXPECT_EQ(failures.read, 0);
    }
    files_->SetFault(Fault::kNone);
    ASSERT_TRUE(hulls_->Create("new").ok());
    ASSERT_TRUE(hulls_->Delete("new").ok());
    EXPECT_EQ(hulls_->store().failures().write, expected.write * 2);
  }
}

TEST_F(StoreFault, SyncsThatFailLaterAreCounted) {
  durability_ = Durability::kRelaxed;
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  files_->SetFault(Fault::kSyncError);
  // Bounded by the time limit of the test alone.
  while (hulls_->store().failures().sync == 0) std::this_thread::yield();
  EXPECT_EQ(hulls_->store().failures().write, 0);
  files_->SetFault(Fault::kNone);
}

TEST_F(StoreFault, FailedReadsAreCounted) {
  Start();
  // More than the block of the records, which is read when the store is opened.
  ASSERT_TRUE(hulls_->Put("h", SpherePoints(1000)).ok());
  Start();
  files_->SetFault(Fault::kReadError);
  for (uint64_t attempt = 1; attempt <= 2; ++attempt) {
    EXPECT_EQ(hulls_->View("h").status().code(), absl::StatusCode::kUnavailable);
    EXPECT_EQ(hulls_->store().failures().read, attempt);
  }
  files_->SetFault(Fault::kNone);
  EXPECT_EQ(hulls_->View("h")->record.vertex_count, 1000);
  EXPECT_EQ(hulls_->store().failures().read, 2);
  EXPECT_EQ(hulls_->store().failures().write, 0);
  EXPECT_EQ(hulls_->registry().Cache().damaged, 0);
}

TEST_F(StoreFault, EachBatchIsSyncedBeforeItIsAcked) {
  Start();
  const AppendSession session = hulls_->Open("h")->session;
  for (uint64_t i = 1; i <= 20; ++i) {
    const int64_t before = files_->syncs();
    ASSERT_TRUE(hulls_->Append(session, i, {{static_cast<double>(i), 0, 0}}).ok());
    EXPECT_GT(files_->syncs(), before);
  }
}

TEST_F(StoreFault, RelaxedAcksDoNotWaitForTheDisk) {
  durability_ = Durability::kRelaxed;
  sync_interval_ = std::chrono::hours(1);
  Start();
  ASSERT_TRUE(hulls_->Create("h").ok());
  const int64_t before = files_->syncs();
  EXPECT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  EXPECT_EQ(files_->syncs(), before);
  hulls_ = nullptr;
  EXPECT_GT(files_->syncs(), before);
}

TEST_F(StoreFault, RelaxedChangesAreSyncedSoon) {
  durability_ = Durability::kRelaxed;
  Start();
  const int64_t before = files_->syncs();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  // Bounded by the time limit of the test alone.
  while (files_->syncs() == before) std::this_thread::yield();
}

// Shows that the simulated power failure loses unsynced changes.
TEST_F(StoreFault, AnOutageLosesOnlyUnsyncedChanges) {
  durability_ = Durability::kRelaxed;
  sync_interval_ = std::chrono::hours(1);
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  std::mt19937_64 random(3);
  int lost = 0;
  for (int outage = 0; outage < 10; ++outage) {
    const std::string left = directory_ + "/left";
    std::filesystem::remove_all(left);
    files_->CopySurvivors(directory_ + "/data", left, random);
    rocksdb::Env* const faulty = std::exchange(env_, nullptr);
    absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("left");
    env_ = faulty;
    ASSERT_TRUE(store.ok()) << store.status();
    if (!DurableRegistry(*std::move(store)).View("h").ok()) ++lost;
  }
  EXPECT_GT(lost, 0);
}

TEST_F(StoreFault, TheDirectoriesOfANewStoreAreOnDiskBeforeItServes) {
  const absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("new/parent/data");
  ASSERT_TRUE(store.ok()) << store.status();
  for (const char* made : {"/new", "/new/parent", "/new/parent/data", "/new/parent/data/rocksdb"}) {
    EXPECT_THAT(files_->directories(), ::testing::Contains(directory_ + made));
  }
  EXPECT_THAT(files_->unsynced_directories(), ::testing::IsEmpty());
}

// Simulates a first start that was killed before it had synced its directories.
TEST_F(StoreFault, DirectoriesThatAFirstStartLeftUnsyncedAreSyncedByTheNext) {
  ASSERT_TRUE(faulty_env_->CreateDir(directory_ + "/new").ok());
  ASSERT_TRUE(faulty_env_->CreateDir(directory_ + "/new/data").ok());
  ASSERT_TRUE(faulty_env_->CreateDir(directory_ + "/new/data/rocksdb").ok());
  ASSERT_TRUE(OpenStore("new/data").ok());
  EXPECT_THAT(files_->unsynced_directories(), ::testing::IsEmpty());
}

TEST_F(StoreFault, AFailedFirstChangeKeepsTheStoreId) {
  Start();
  const std::string id = hulls_->store().id();
  files_->SetFault(Fault::kNoSpace);
  EXPECT_FALSE(hulls_->Put("h", CubeCorners()).ok());
  files_->SetFault(Fault::kNone);
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const uint64_t revision = hulls_->registry().Sizes().store_revision;
  Start();
  EXPECT_EQ(hulls_->store().id(), id);
  EXPECT_EQ(hulls_->registry().Sizes().store_revision, revision);
  EXPECT_EQ(hulls_->View("h")->record.vertex_count, 8);
}

TEST_F(StoreFault, RecoveryKeepsAFileNamedLikeItsProbe) {
  Start();
  const std::string path = directory_ + "/data/probe";
  std::ofstream(path) << "mine";
  files_->SetFault(Fault::kIoError);
  EXPECT_FALSE(hulls_->Put("h", CubeCorners()).ok());
  files_->SetFault(Fault::kNone);
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  std::string content;
  std::ifstream(path) >> content;
  EXPECT_EQ(content, "mine");
}

TEST_F(StoreFault, AnUnreadableStoreIsNotCopied) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  std::ofstream(directory_ + "/data/rocksdb/CURRENT") << "nothing";
  files_->SetFault(Fault::kSyncError);
  EXPECT_FALSE(hulls_->Put("h", CubeCorners()).ok());
  files_->SetFault(Fault::kNone);
  EXPECT_FALSE(hulls_->Put("h", CubeCorners()).ok());
  const auto directories = [this] {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(directory_ + "/data")) {
      if (entry.is_directory()) found.push_back(entry.path());
    }
    return found;
  };
  const std::vector<std::string> before = directories();
  EXPECT_EQ(hulls_->store().MakeCopy().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(directories(), before);
}

// Its lost revisions may be assigned to other changes.
TEST_F(StoreFault, ARelaxedStoreGetsANewIdAfterAnOutage) {
  durability_ = Durability::kRelaxed;
  sync_interval_ = std::chrono::hours(1);
  Start();
  const std::string id = hulls_->store().id();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  std::mt19937_64 random(5);
  files_->CopySurvivors(directory_ + "/data", directory_ + "/left", random);
  env_ = nullptr;
  std::vector<std::string> ids;
  for (const Durability durability : {Durability::kSync, Durability::kRelaxed, Durability::kSync}) {
    durability_ = durability;
    const absl::StatusOr<std::unique_ptr<RocksDbStore>> left = OpenStore("left");
    ASSERT_TRUE(left.ok()) << left.status();
    ids.push_back((*left)->id());
  }
  EXPECT_NE(ids[0], id);
  // These starts ended in order.
  EXPECT_EQ(ids[1], ids[0]);
  EXPECT_EQ(ids[2], ids[0]);
}

TEST_F(StoreFault, ARelaxedStoreWithAFailedFinalSyncGetsANewId) {
  durability_ = Durability::kRelaxed;
  sync_interval_ = std::chrono::hours(1);
  Start();
  const std::string id = hulls_->store().id();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  Start();
  EXPECT_EQ(hulls_->store().id(), id);
  files_->SetFault(Fault::kSyncError);
  hulls_ = nullptr;
  files_->SetFault(Fault::kNone);
  Start();
  EXPECT_NE(hulls_->store().id(), id);
}

TEST_F(StoreFault, ADurableStoreKeepsItsIdThroughAnOutage) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  std::mt19937_64 random(5);
  files_->CopySurvivors(directory_ + "/data", directory_ + "/left", random);
  env_ = nullptr;
  const absl::StatusOr<std::unique_ptr<RocksDbStore>> left = OpenStore("left");
  ASSERT_TRUE(left.ok()) << left.status();
  EXPECT_EQ((*left)->id(), hulls_->store().id());
}

// Acknowledgements by hull: sums over the acknowledged chunks.
class Acks {
 public:
  struct Hull {
    uint64_t sequence = 0;
    uint64_t revision = 0;
    uint64_t received = 0;
  };
  void Note(const std::string& id, uint64_t sequence, const ChunkResult& result) {
    const std::lock_guard lock(mutex_);
    Hull& hull = hulls_[id];
    hull.sequence = sequence;
    hull.revision = result.hull_revision;
    hull.received += result.counts.received;
  }
  std::map<std::string, Hull> Get() const {
    const std::lock_guard lock(mutex_);
    return hulls_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Hull> hulls_;
};

// Power fails at random moments under four writers. Every acknowledged chunk survives, every hull
// passes its audit, and no revision goes back.
TEST_F(StoreFault, NoAckPrecedesItsSync) {
  constexpr int kOutages = TestSize(50, 12);
  constexpr int kWriters = 4;
  constexpr uint64_t kSeed = 811;
  RecordProperty("seed", std::to_string(kSeed));
  Start();
  Acks acks;
  std::atomic<bool> ending = false;
  std::vector<std::thread> writers;
  writers.reserve(kWriters);
  for (int w = 0; w < kWriters; ++w) {
    writers.emplace_back([&, w] {
      const std::string id = absl::StrCat("h", w);
      const absl::StatusOr<OpenResult> opened = hulls_->Open(id);
      ASSERT_TRUE(opened.ok());
      std::mt19937_64 random(kSeed + w);
      std::uniform_real_distribution<double> coordinate(-1, 1);
      // Several chunks are in flight, so that batches and chains of changes are cut.
      constexpr int kInFlight = 8;
      const auto slots = std::make_shared<std::counting_semaphore<kInFlight>>(kInFlight);
      for (uint64_t sequence = 1; !ending; ++sequence) {
        std::vector<Vector> points;
        for (uint64_t i = random() % 60; i > 0; --i) {
          points.emplace_back(coordinate(random), coordinate(random), coordinate(random));
        }
        slots->acquire();
        hulls_->registry().changes().Append(
            opened->session, {sequence, std::move(points), std::nullopt}, {}, {},
            [&, slots, id, sequence](absl::StatusOr<ChunkResult> result) {
              if (result.ok()) acks.Note(id, sequence, *result);
              slots->release();
            });
      }
      for (int i = 0; i < kInFlight; ++i) slots->acquire();
    });
  }
  std::mt19937_64 random(kSeed);
  uint64_t chunks = 0;
  std::map<std::string, uint64_t> last_revision;
  for (int outage = 0; outage < kOutages; ++outage) {
    SCOPED_TRACE(absl::StrCat("outage ", outage));
    const std::string left = directory_ + "/left";
    std::filesystem::remove_all(left);
    const std::map<std::string, Acks::Hull> acked = acks.Get();
    files_->CopySurvivors(directory_ + "/data", left, random);

    rocksdb::Env* const faulty = std::exchange(env_, nullptr);
    absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("left");
    env_ = faulty;
    EXPECT_TRUE(store.ok()) << store.status();
    if (!store.ok()) break;
    DurableRegistry survivors(*std::move(store));
    EXPECT_TRUE(survivors.loaded().ok());
    for (const auto& [id, ack] : acked) {
      const auto view = survivors.View(id);
      EXPECT_TRUE(view.ok()) << view.status();
      if (!view.ok()) continue;
      EXPECT_GE(survivors.Open(id)->last_sequence, ack.sequence);
      EXPECT_GE(view->record.revision, ack.revision);
      EXPECT_GE(view->record.revision, last_revision[id]);
      EXPECT_GE(view->record.counts.received, ack.received);
      EXPECT_TRUE(AuditHull(CanonicalOf(*view)).ok());
      last_revision[id] = ack.revision;
      chunks = std::max(chunks, ack.sequence);
    }
  }
  ending = true;
  for (std::thread& writer : writers) writer.join();
  EXPECT_GT(chunks, 0);
  RecordProperty("chunks_of_one_writer", static_cast<int>(chunks));
}

}  // namespace store_fault_test
}  // namespace hulld::server
