#ifndef HULLD_SERVER_STORE_ROCKSDB_STORE_H_
#define HULLD_SERVER_STORE_ROCKSDB_STORE_H_

#include <absl/status/statusor.h>
#include <rocksdb/db.h>
#include <rocksdb/env.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/store/log_file_system.h"
#include "server/store/sealed_hull.h"
#include "server/store/store.h"
#include "server/store/store_keys.h"

namespace hulld::server {

struct RocksDbOptions {
  // Made when it does not exist, and on disk before anything is acknowledged.
  std::string data_dir;
  // kSync or kRelaxed.
  Durability durability = Durability::kSync;
  // Relaxed: how often what was written is synced.
  std::chrono::milliseconds sync_interval{500};
  // Looks without touching: nothing can be committed, and another process may have it open.
  bool read_only = false;
  // Opens a store whose log is damaged as it was before the first damaged record: what was
  // acknowledged after that is lost, and the store takes a new ID.
  bool cut_log = false;
  // Opens a store that a migration has not finished, too.
  bool migrating = false;
  // Null: the file system.
  rocksdb::Env* env = nullptr;
};

// Keeps hulls in a RocksDB database under <data-dir>/rocksdb. See store_keys.h for what is in it.
//
// A batch of changes is one write to the log, synced once, before it is acknowledged. What is read
// is checked twice: by the checksums of RocksDB's blocks, and by our own of each value, which name
// the hull that is damaged.
class RocksDbStore : public Store {
 public:
  // INVALID_ARGUMENT: no directory; FAILED_PRECONDITION: another process has it open, or a newer
  // hulld wrote it; DATA_LOSS: its log or its files are damaged; NOT_FOUND: read_only, and there is
  // none; UNAVAILABLE: the file system refuses.
  static absl::StatusOr<std::unique_ptr<RocksDbStore>> Open(RocksDbOptions options);

  ~RocksDbStore() override;

  std::string kind() const override { return "rocksdb"; }
  std::string id() const override { return id_; }
  Durability durability() const override { return options_.durability; }
  bool keeps_hulls() const override { return true; }
  uint64_t revision() const override { return revision_; }
  absl::Status ForEachHull(const StoredHullVisitor& visit) override;
  absl::Status ForEachBody(const StoredBodyVisitor& visit) override;
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override;
  // Asks for the first values of all at once, so that a block that holds several is read once.
  std::vector<absl::StatusOr<std::vector<Vector>>> LoadVerticesOfEach(
      std::span<const StoredHull* const> hulls) override;
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override;
  absl::StatusOr<std::vector<WriterSequence>> LoadWriters(const StoredHull& hull) override;
  absl::Status Commit(std::span<Change* const> changes) override;
  absl::Status Recover() override;
  StoreFailures failures() const override {
    return {write_failures_.load(std::memory_order_relaxed),
            sync_failures_.load(std::memory_order_relaxed),
            read_failures_.load(std::memory_order_relaxed)};
  }

  std::optional<StoreDisk> disk() const override;

  // Hard links in <data-dir>/hulld-scratch/copy-..., in the layout of a data directory.
  absl::StatusOr<std::string> MakeCopy() override;

  // For a migration: writes what it copies, on disk before this returns; and the value of its mark
  // (kMigrationKey), if that is there.
  absl::Status Import(rocksdb::WriteBatch* batch) { return WriteMeta(batch); }
  absl::StatusOr<std::optional<std::string>> ReadMigrationMark() { return Read(kMigrationKey); }

  const std::string& data_dir() const { return options_.data_dir; }
  // RocksDB's own, for tests that damage what is kept.
  rocksdb::DB& db() { return *db_; }

 private:
  explicit RocksDbStore(RocksDbOptions options);

  rocksdb::Options DbOptions() const;
  absl::Status MakeDirectories();
  rocksdb::Status SyncDirectory(const std::string& path);
  absl::Status OpenDb();
  // As one of a sync when one failed since the last that was counted.
  void CountWriteFailure();
  // Counts a failure, and says what it means.
  absl::Status WriteFailed(const rocksdb::Status& status);
  absl::Status ReadFailed(const rocksdb::Status& status);
  absl::Status ReadMeta();
  absl::Status InitializeMeta();
  absl::Status BeginRun();
  absl::Status EndRelaxedRun();
  absl::Status WriteMeta(rocksdb::WriteBatch* batch);
  // The value of a key, without its checksum; nullopt: there is none. DATA_LOSS, UNAVAILABLE.
  absl::StatusOr<std::optional<std::string>> Read(const std::string& key);
  absl::StatusOr<std::optional<uint64_t>> ReadNumber(const std::string& key);
  // Visits the sealed values of these keys, by index, as far as they are there and can be read.
  void FindValues(std::span<const std::string> keys,
                  const std::function<void(size_t, std::string_view)>& visit);
  absl::Status ScanRange(
      const std::string& begin, const std::string& end,
      const std::function<absl::Status(std::string_view, std::string_view)>& visit);
  absl::Status DropLostIncarnations();
  absl::Status LoadBase(const StoredHull& hull, VertexAssembly* assembly);
  absl::Status LoadDeltas(const StoredHull& hull, VertexAssembly* assembly);
  // Stalls of the database that is open.
  uint64_t CountStalls() const;
  absl::Status Probe();
  absl::Status Reopen();
  absl::Status SyncLog();
  void SyncAtIntervals();

  const RocksDbOptions options_;
  std::shared_ptr<LogFileSystem> files_;
  std::unique_ptr<rocksdb::Env> env_;
  std::string id_;
  uint64_t revision_ = 0;
  // Whether kRelaxedKey is there, and ours to remove.
  bool relaxed_run_ = false;

  // Shared while db_ is used, exclusive in Reopen.
  mutable std::shared_mutex db_mutex_;
  std::unique_ptr<rocksdb::DB> db_;
  // The stalls of the databases that were open here before this one, as each counts its own.
  uint64_t former_stalls_ = 0;

  // Held while the log is written or synced.
  std::mutex log_mutex_;
  // Once writing the log failed it must not be touched again: only reading goes on, until Recover
  // opens the database anew.
  absl::Status failure_;

  std::atomic<uint64_t> seen_failed_syncs_ = 0;
  std::atomic<uint64_t> write_failures_ = 0;
  std::atomic<uint64_t> sync_failures_ = 0;
  std::atomic<uint64_t> read_failures_ = 0;

  std::mutex sync_mutex_;
  std::condition_variable sync_wake_;
  bool ending_ = false;
  std::thread syncer_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_ROCKSDB_STORE_H_
