#ifndef HULLD_SERVER_STORE_ROCKSDB_STORE_H_
#define HULLD_SERVER_STORE_ROCKSDB_STORE_H_

#include <absl/status/statusor.h>
#include <rocksdb/db.h>
#include <rocksdb/env.h>
#include <rocksdb/write_batch.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/process/periodic_task.h"
#include "server/store/files/disk_reserve.h"
#include "server/store/files/log_file_system.h"
#include "server/store/store.h"
#include "server/store/store_keys.h"

namespace hulld::server {

// Paths in --data-dir.
inline std::string DatabaseDirectory(const std::string& data_dir) { return data_dir + "/rocksdb"; }

// A directory for temporary files, emptied at each start. Other files in the data directory are not
// touched.
inline std::string ScratchDirectory(const std::string& data_dir) {
  return data_dir + "/hulld-scratch";
}

// The high-water mark of the write-ahead logs (files/log_mark.h).
inline std::string LogMarkPath(const std::string& data_dir) { return data_dir + "/hulld-log-mark"; }

// The reserve for a full disk (files/disk_reserve.h).
inline std::string ReservePath(const std::string& data_dir) { return data_dir + "/hulld-reserve"; }

// A file that 'hullctl backup restore' leaves in its new directory.
inline std::string RestoredMark(const std::string& data_dir) { return data_dir + "/restored"; }

// Adds a value with its checksum to the batch.
void PutSealed(rocksdb::WriteBatch& batch, const std::string& key, std::string value);

// Adds the effect of a change on the keys of the store (store_keys.h), except the store's revision.
void EncodeChange(rocksdb::WriteBatch& batch, const Change& change);

struct RocksDbOptions {
  // Created if missing, and on disk before the first acknowledgement.
  std::string data_dir;
  // kSync or kRelaxed.
  Durability durability = Durability::kSync;
  // Interval of syncs of the log's mark, and of the log itself if the store is relaxed.
  std::chrono::milliseconds sync_interval{500};
  // Opens the store without changing anything. No other process may have it open.
  bool read_only = false;
  // Opens a store with a damaged or incomplete log, dropping all changes after the first damaged
  // record or incomplete log. These acknowledged changes are lost, and the store gets a new ID.
  bool accept_loss = false;
  // Also opens the destination of an unfinished migration.
  bool migrating = false;
  // Disk space that is reserved for deletions and for a start on a full disk. The default covers
  // the writes of opening a store (**proven** from DbOptions): two memtables of 16 MiB as
  // tables, 17.6 MiB that are reserved for the new log, and 4 MiB for the manifest; the rest is for
  // the logs of deletions.
  uint64_t reserve_bytes = uint64_t{64} << 20;
  // Null: the real file system.
  rocksdb::Env* env = nullptr;
};

// Keeps hulls in a RocksDB database under <data-dir>/rocksdb, with the keys of store_keys.h.
//
// A batch of changes is one write to the log and one sync, before it is acknowledged. Reads are
// checked twice: by the checksums of RocksDB's blocks, and by a checksum of each value, which
// identifies the damaged hull.
class RocksDbStore : public Store {
 public:
  // On a full disk, the store is opened with the space of the reserve: for deletions if possible,
  // otherwise read-only.
  //
  // INVALID_ARGUMENT: no directory; FAILED_PRECONDITION: another process has it open, or it is in
  // another format; DATA_LOSS: its log or its files are damaged or incomplete, and nothing was
  // changed; NOT_FOUND: read_only, and the store does not exist; RESOURCE_EXHAUSTED: the disk is
  // full, and the store needs a new ID or does not exist yet; UNAVAILABLE: the file system returned
  // an error.
  static absl::StatusOr<std::unique_ptr<RocksDbStore>> Open(RocksDbOptions options);

  ~RocksDbStore() override;

  std::string kind() const override { return "rocksdb"; }
  const std::string& id() const override { return id_; }
  Durability durability() const override { return options_.durability; }
  bool keeps_hulls() const override { return true; }
  uint64_t revision() const override { return revision_; }
  absl::Status ForEachRecord(const StoredHullVisitor& visit_hull,
                             const StoredBodyVisitor& visit_body) override;
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override;
  // Reads the first values of all hulls together, so that a block with several values is one read.
  std::vector<absl::StatusOr<std::vector<Vector>>> LoadVerticesOfEach(
      std::span<const StoredHull> hulls) override;
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

  // The copy consists of hard links in <data-dir>/hulld-scratch/copy-..., a data directory.
  absl::StatusOr<std::string> MakeCopy() override;

  // For a migration: writes a batch and syncs it; and returns the value of kMigrationKey, if any.
  absl::Status Import(rocksdb::WriteBatch* batch) { return WriteMeta(batch); }
  absl::StatusOr<std::optional<std::string>> ReadMigrationMark() { return Read(kMigrationKey); }

  const std::string& data_dir() const { return options_.data_dir; }
  // For tests that damage stored values.
  rocksdb::DB& db() { return *db_; }

 private:
  explicit RocksDbStore(RocksDbOptions options);

  rocksdb::Options DbOptions() const;
  absl::Status MakeDirectories();
  absl::Status OpenDb();
  // Opens the database, using the space of the reserve if the disk is full.
  absl::Status OpenDbWithReserve();
  // Opens the database for reading, without its lock.
  rocksdb::Status OpenForReading();
  absl::Status Lock();
  // Compares the logs and the manifest with their mark. Requires: this process holds the database's
  // lock, or there is no database.
  absl::Status CheckLogs();
  absl::Status DropLogsFrom(uint64_t number);
  absl::Status StartMark();
  // Returns DISK_FULL if a change is not a deletion and the reserve cannot be restored.
  absl::Status CheckRoom(std::span<Change* const> changes);
  // Frees the disk space of deleted hulls.
  void Compact(std::span<Change* const> changes);
  // Counts a failed sync if a sync failed since the last count, otherwise a failed write.
  void CountWriteFailure();
  // Counts the failure of a write, and returns its error for the client.
  absl::Status WriteFailed(const rocksdb::Status& status);
  // Counts the failure of a read, and returns its error for the client. DATA_LOSS: the value is
  // damaged, which does not count as a failure of the disk.
  absl::Status ReadFailed(const rocksdb::Status& status);
  absl::Status ReadMeta();
  absl::Status InitializeMeta();
  absl::Status BeginRun();
  absl::Status EndRelaxedRun();
  absl::Status WriteMeta(rocksdb::WriteBatch* batch);
  // Returns the value of a key without its checksum, if any. DATA_LOSS: it is damaged. UNAVAILABLE:
  // it cannot be read.
  absl::StatusOr<std::optional<std::string>> Read(const std::string& key);
  absl::StatusOr<std::optional<uint64_t>> ReadNumber(const std::string& key);
  absl::Status ScanRange(
      const std::string& begin, const std::string& end,
      const std::function<absl::Status(std::string_view, std::string_view)>& visit);
  absl::Status DropLostIncarnations();
  absl::Status LoadBase(const StoredHull& hull, VertexAssembly* assembly);
  absl::Status LoadDeltas(const StoredHull& hull, VertexAssembly* assembly);
  // Returns the stalls of the open database.
  uint64_t CountStalls() const;
  absl::Status Probe();
  absl::Status Reopen();
  absl::Status SyncLog();
  void SyncInBackground();

  const RocksDbOptions options_;
  std::shared_ptr<LogFileSystem> files_;
  std::unique_ptr<rocksdb::Env> env_;
  DiskReserve reserve_;
  // The database's lock if the store is read-only; otherwise RocksDB holds it.
  rocksdb::FileLock* lock_ = nullptr;
  // Result of CheckLogs, which runs inside RocksDB's Open.
  absl::Status logs_checked_;
  std::string id_;
  uint64_t revision_ = 0;
  // True if this run wrote kRelaxedKey and must delete it.
  bool relaxed_run_ = false;

  // Shared while db_ is used, exclusive in Reopen.
  mutable std::shared_mutex db_mutex_;
  std::unique_ptr<rocksdb::DB> db_;
  // Stalls before the database was last reopened, which resets its own count.
  uint64_t previous_stalls_ = 0;

  // Held while the log is written or synced.
  std::mutex log_mutex_;
  // The error after which the log must not be written: only reads continue, until Recover reopens
  // the database.
  absl::Status failure_;

  std::atomic<uint64_t> seen_failed_syncs_ = 0;
  std::atomic<uint64_t> write_failures_ = 0;
  std::atomic<uint64_t> sync_failures_ = 0;
  std::atomic<uint64_t> read_failures_ = 0;

  // Calls SyncInBackground unless the store is read-only.
  std::optional<PeriodicTask> syncs_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_ROCKSDB_STORE_H_
