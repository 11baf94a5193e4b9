// Opening a store: directories, format, and recovery after the previous run.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <rocksdb/cache.h>
#include <rocksdb/table.h>
#include <rocksdb/write_batch.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/process/random_id.h"
#include "server/store/rocksdb_store.h"
#include "server/store/store_errors.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

// RocksDB's diagnostics, in the server's log. RocksDB would write them to a file of its own, and
// abort when the disk is full and that file cannot be written (observed: an assertion of 7.8).
class Diagnostics : public rocksdb::Logger {
 public:
  Diagnostics() : Logger(rocksdb::InfoLogLevel::WARN_LEVEL) {}

  __attribute__((format(printf, 2, 0))) void Logv(const char* /*format*/,
                                                  va_list /*arguments*/) override {}
  __attribute__((format(printf, 3, 0))) void Logv(rocksdb::InfoLogLevel level, const char* format,
                                                  va_list arguments) override {
    const bool is_error =
        level == rocksdb::InfoLogLevel::ERROR_LEVEL || level == rocksdb::InfoLogLevel::FATAL_LEVEL;
    if (!is_error && level != rocksdb::InfoLogLevel::WARN_LEVEL) return;
    char text[1024];
    std::vsnprintf(text, sizeof text, format, arguments);
    spdlog::log(is_error ? spdlog::level::warn : spdlog::level::debug, "RocksDB: {}", text);
  }
};

// Removes the remains of a killed server.
void ClearScratch(const std::string& data_dir) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(ScratchDirectory(data_dir), error)) {
    std::filesystem::remove_all(entry.path(), error);
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<RocksDbStore>> RocksDbStore::Open(RocksDbOptions options) {
  if (options.data_dir.empty()) {
    return InvalidArgument("--data-dir is empty; name the directory of the store");
  }
  std::unique_ptr<RocksDbStore> store(new RocksDbStore(std::move(options)));
  const bool read_only = store->options_.read_only;
  HULLD_RETURN_IF_ERROR(read_only ? store->Lock() : store->MakeDirectories());
  HULLD_RETURN_IF_ERROR(store->OpenDbWithReserve());
  HULLD_RETURN_IF_ERROR(store->ReadMeta());
  if (read_only) return store;
  ClearScratch(store->options_.data_dir);
  HULLD_RETURN_IF_ERROR(store->StartMark());
  store->syncs_.emplace(store->options_.sync_interval,
                        [raw = store.get()] { raw->SyncInBackground(); });
  return store;
}

RocksDbStore::RocksDbStore(RocksDbOptions options)
    : options_(std::move(options)),
      files_(std::make_shared<LogFileSystem>(
          (options_.env != nullptr ? options_.env : rocksdb::Env::Default())->GetFileSystem(),
          DatabaseDirectory(options_.data_dir))),
      env_(rocksdb::NewCompositeEnv(files_)),
      reserve_(*files_, ReservePath(options_.data_dir), options_.reserve_bytes) {
  files_->OnLocked([this] {
    logs_checked_ = CheckLogs();
    return logs_checked_.ok() ? rocksdb::IOStatus::OK()
                              : rocksdb::IOStatus::Corruption("see logs_checked_");
  });
}

RocksDbStore::~RocksDbStore() {
  syncs_.reset();
  if (relaxed_run_ && db_ != nullptr) EndRelaxedRun().IgnoreError();
  // Retries to cut off the remains of a failed write.
  db_ = nullptr;
  if (lock_ != nullptr) env_->UnlockFile(lock_).PermitUncheckedError();
  files_->SyncMark().PermitUncheckedError();
  if (failure_.ok() || files_->CutUncommitted().ok()) return;
  spdlog::error("the log in {} may contain changes that were refused", options_.data_dir);
}

rocksdb::Options RocksDbStore::DbOptions() const {
  rocksdb::Options options;
  options.env = env_.get();
  options.create_if_missing = !options_.read_only;
  options.paranoid_checks = true;
  // An incomplete record at the end of a log is dropped: it is beyond the mark of the log, so it
  // was not acknowledged. Any other checksum mismatch is an error. If power was lost during a
  // write, pages may have reached the disk out of order (with kSync, of the last record at most);
  // an acknowledged record that was damaged later looks the same.
  options.wal_recovery_mode = options_.accept_loss
                                  ? rocksdb::WALRecoveryMode::kPointInTimeRecovery
                                  : rocksdb::WALRecoveryMode::kTolerateCorruptedTailRecords;
  // Coordinates do not compress, and uncompressed blocks can be read around damage.
  options.compression = rocksdb::kNoCompression;
  options.write_buffer_size = 16 << 20;
  options.max_total_wal_size = 256 << 20;
  options.max_background_jobs = 2;
  options.max_open_files = 256;
  options.info_log = std::make_shared<Diagnostics>();
  rocksdb::BlockBasedTableOptions table;
  table.checksum = rocksdb::kXXH3;
  table.format_version = 5;
  // Hulls are cached by the registry.
  table.block_cache = rocksdb::NewLRUCache(8 << 20);
  options.table_factory.reset(rocksdb::NewBlockBasedTableFactory(table));
  return options;
}

// A commit is only as durable as the directory entries on its path. Existing directories are
// synced, too: an earlier start may have been killed between making and syncing them. Some of them
// may be inaccessible, which is not an error.
absl::Status RocksDbStore::MakeDirectories() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path database =
      fs::absolute(DatabaseDirectory(options_.data_dir), error).lexically_normal();
  // Created at startup after the directories are durable.
  if (env_->FileExists((database / "CURRENT").string()).ok()) return absl::OkStatus();
  const auto failure = [this](const fs::path& path, const rocksdb::Status& status) {
    return Unavailable("cannot create --data-dir ", options_.data_dir, ": ", path.string(), ": ",
                       status.ToString());
  };
  std::vector<fs::path> missing;
  fs::path above = database;
  while (above != above.root_path() && !fs::exists(above, error)) {
    missing.push_back(above);
    above = above.parent_path();
  }
  for (auto path = missing.rbegin(); path != missing.rend(); ++path) {
    const rocksdb::Status made = env_->CreateDirIfMissing(path->string());
    if (!made.ok()) return failure(*path, made);
  }
  for (const fs::path& path : missing) {
    const rocksdb::Status synced = SyncDirectory(*files_, path);
    if (!synced.ok()) return failure(path, synced);
  }
  for (fs::path path = above;; path = path.parent_path()) {
    const rocksdb::Status synced = SyncDirectory(*files_, path);
    const bool ours = path == above || path == database.parent_path();
    if (!synced.ok() && ours) return failure(path, synced);
    if (path == path.root_path()) return absl::OkStatus();
  }
}

absl::Status RocksDbStore::OpenDb() {
  logs_checked_ = absl::OkStatus();
  rocksdb::DB* db = nullptr;
  const rocksdb::Status status =
      options_.read_only
          ? OpenForReading()
          : rocksdb::DB::Open(DbOptions(), DatabaseDirectory(options_.data_dir), &db);
  if (!logs_checked_.ok()) return logs_checked_;
  if (options_.accept_loss && status.IsCorruption()) {
    return DamagedBeyondLog(status, options_.data_dir);
  }
  if (!status.ok()) return OpenError(status, options_.data_dir, options_.read_only);
  if (db != nullptr) db_.reset(db);
  return absl::OkStatus();
}

rocksdb::Status RocksDbStore::OpenForReading() {
  rocksdb::DB* db = nullptr;
  rocksdb::Status status =
      rocksdb::DB::OpenForReadOnly(DbOptions(), DatabaseDirectory(options_.data_dir), &db);
  if (status.ok()) db_.reset(db);
  return status;
}

absl::Status RocksDbStore::OpenDbWithReserve() {
  absl::Status opened = OpenDb();
  if (options_.read_only || options_.migrating) return opened;
  if (IsDiskFull(opened) && reserve_.Release()) opened = OpenDb();
  if (!IsDiskFull(opened)) {
    if (opened.ok() && !reserve_.Ensure().ok()) {
      spdlog::warn("the disk of {} is full: only deletions are accepted until {} MiB",
                   options_.data_dir, options_.reserve_bytes >> 20);
    }
    return opened;
  }
  if (!OpenForReading().ok()) return opened;
  spdlog::warn("the disk of {} is full: changes are refused until {} MiB", options_.data_dir,
               options_.reserve_bytes >> 20);
  failure_ = opened;
  return absl::OkStatus();
}

// RocksDB takes the lock itself, except for read-only access. A read-only file system needs no
// lock, because no process can write there.
absl::Status RocksDbStore::Lock() {
  const std::string directory = DatabaseDirectory(options_.data_dir);
  if (!env_->FileExists(CurrentPath(directory)).ok()) {
    HULLD_RETURN_IF_ERROR(CheckLogs());
    return absl::NotFoundError(
        absl::StrCat("--data-dir ", options_.data_dir, " contains no hulld store"));
  }
  if (access(directory.c_str(), W_OK) != 0 && errno == EROFS) return CheckLogs();
  const rocksdb::Status locked = env_->LockFile(directory + "/LOCK", &lock_);
  if (!logs_checked_.ok()) return logs_checked_;
  return locked.ok() ? absl::OkStatus() : OpenError(locked, options_.data_dir, true);
}

absl::Status RocksDbStore::CheckLogs() {
  const std::string directory = DatabaseDirectory(options_.data_dir);
  const std::string path = LogMarkPath(options_.data_dir);
  absl::StatusOr<std::optional<LogMark>> mark = ReadLogMark(*files_, path);
  const std::optional<LogMark> known = mark.ok() ? *mark : std::nullopt;
  HULLD_ASSIGN_OR_RETURN(const std::string finding, FindLostManifest(*files_, directory, known));
  if (!finding.empty()) {
    return ManifestLost(options_.data_dir, finding,
                        known.has_value() ? std::optional(known->revision) : std::nullopt);
  }
  if (absl::IsDataLoss(mark.status())) {
    if (options_.accept_loss) return absl::OkStatus();
    return LogLost(options_.data_dir, std::string(mark.status().message()), std::nullopt);
  }
  if (!mark.ok()) return mark.status();
  if (!mark->has_value()) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(const std::optional<LostLog> lost,
                         FindLostLog(*files_, directory, **mark));
  if (options_.accept_loss) {
    return lost.has_value() ? DropLogsFrom(lost->number + 1) : absl::OkStatus();
  }
  if (lost.has_value()) return LogLost(options_.data_dir, lost->finding, (*mark)->revision);
  if (options_.read_only) return absl::OkStatus();
  const rocksdb::IOStatus resumed = files_->ResumeMark(path, *std::move(*mark));
  return resumed.ok() ? absl::OkStatus() : OpenError(resumed, options_.data_dir, false);
}

// Changes after a gap are dropped, so that the store has the state at one revision.
absl::Status RocksDbStore::DropLogsFrom(uint64_t number) {
  const std::string directory = DatabaseDirectory(options_.data_dir);
  std::vector<std::string> names;
  rocksdb::Status status = env_->GetChildren(directory, &names);
  for (const std::string& name : names) {
    const std::optional<uint64_t> log = LogNumber(name);
    if (status.ok() && log.has_value() && *log >= number) {
      status = env_->DeleteFile(LogPath(directory, *log));
    }
  }
  return status.ok() ? absl::OkStatus() : OpenError(status, options_.data_dir, false);
}

// A new store, a restored backup, and a store with an accepted loss, which already has its new ID,
// get a new mark.
absl::Status RocksDbStore::StartMark() {
  if (files_->keeps_mark()) return absl::OkStatus();
  const rocksdb::IOStatus started = files_->StartMark(LogMarkPath(options_.data_dir), revision_);
  if (started.ok()) return absl::OkStatus();
  const absl::Status error = OpenError(started, options_.data_dir, false);
  if (!IsDiskFull(error)) return error;
  spdlog::warn("the disk of {} is full: the log mark is not kept", options_.data_dir);
  return absl::OkStatus();
}

absl::Status RocksDbStore::ReadMeta() {
  const absl::StatusOr<std::optional<uint64_t>> format = ReadNumber(kFormatKey);
  if (!format.ok()) return Prefixed("the store's format: ", format.status());
  if (!format->has_value()) {
    if (options_.read_only) {
      return absl::NotFoundError(
          absl::StrCat("--data-dir ", options_.data_dir, " contains no hulld store"));
    }
    if (!failure_.ok()) return failure_;
    HULLD_RETURN_IF_ERROR(InitializeMeta());
    return BeginRun();
  }
  if (**format != kStoreFormat && **format != kFormatWithoutBodies) {
    return OtherFormat(absl::StrCat("--data-dir ", options_.data_dir), **format, kStoreFormat);
  }
  const absl::StatusOr<std::optional<std::string>> mark = ReadMigrationMark();
  if (absl::IsUnavailable(mark.status())) return mark.status();
  // A damaged mark counts as a mark.
  if (!options_.migrating && (!mark.ok() || mark->has_value())) {
    return Prefixed(absl::StrCat("--data-dir ", options_.data_dir, ": "), UnfinishedMigration());
  }
  absl::StatusOr<std::optional<std::string>> id = Read(kStoreIdKey);
  if (!id.ok()) return Prefixed("the store's ID: ", id.status());
  if (!id->has_value()) return absl::DataLossError("the store's ID is missing");
  id_ = **std::move(id);
  const absl::StatusOr<std::optional<uint64_t>> revision = ReadNumber(kRevisionKey);
  if (!revision.ok()) return Prefixed("the store's revision: ", revision.status());
  if (!revision->has_value()) return absl::DataLossError("the store's revision is missing");
  revision_ = **revision;
  if (options_.read_only) return absl::OkStatus();
  HULLD_RETURN_IF_ERROR(BeginRun());
  return failure_.ok() ? DropLostIncarnations() : absl::OkStatus();
}

absl::Status RocksDbStore::InitializeMeta() {
  id_ = RandomId();
  rocksdb::WriteBatch batch;
  PutSealed(batch, kFormatKey, EncodeNumber(kStoreFormat));
  PutSealed(batch, kStoreIdKey, id_);
  PutSealed(batch, kRevisionKey, EncodeNumber(0));
  return WriteMeta(&batch);
}

// Runs before anything is served or committed. A store that may lack acknowledged changes gets a
// new ID, because their revisions will be assigned to other changes: a restored backup, a store
// with an accepted loss, and a relaxed store that was not closed. The new ID and the marks in the
// database change atomically, and the mark in the directory is removed last, so that the next start
// repeats an interrupted change.
absl::Status RocksDbStore::BeginRun() {
  std::error_code error;
  const std::string mark = RestoredMark(options_.data_dir);
  const bool restored = std::filesystem::exists(mark, error);
  const absl::StatusOr<std::optional<std::string>> run = Read(kRelaxedKey);
  if (absl::IsUnavailable(run.status())) return run.status();
  // A damaged mark counts as a mark.
  const bool cut_short = !run.ok() || run->has_value();
  const bool relaxed = options_.durability == Durability::kRelaxed;
  const std::string previous_id = id_;
  rocksdb::WriteBatch batch;
  if (options_.accept_loss || restored || cut_short) {
    id_ = RandomId();
    PutSealed(batch, kStoreIdKey, id_);
  }
  if (relaxed) PutSealed(batch, kRelaxedKey, "");
  if (!relaxed && cut_short) batch.Delete(kRelaxedKey);
  if (batch.Count() > 0) {
    if (!failure_.ok()) return failure_;
    HULLD_RETURN_IF_ERROR(WriteMeta(&batch));
  }
  relaxed_run_ = relaxed;
  if (restored &&
      (!std::filesystem::remove(mark, error) || !SyncDirectory(*files_, options_.data_dir).ok())) {
    return Unavailable("cannot remove ", mark);
  }
  if (restored) {
    spdlog::info("restored from a backup of store {} at revision {}; the new store ID is {}",
                 previous_id, revision_, id_);
  } else if (cut_short) {
    spdlog::warn(
        "store {} was open with --durability=relaxed and not shut down cleanly; its last "
        "acknowledged changes may be lost; continuing at revision {} as store {}",
        previous_id, revision_, id_);
  }
  return absl::OkStatus();
}

// Syncs the log, then removes the mark. If that fails, the mark stays.
absl::Status RocksDbStore::EndRelaxedRun() {
  HULLD_RETURN_IF_ERROR(SyncLog());
  rocksdb::WriteBatch batch;
  batch.Delete(kRelaxedKey);
  return WriteMeta(&batch);
}

absl::Status RocksDbStore::WriteMeta(rocksdb::WriteBatch* batch) {
  rocksdb::WriteOptions options;
  options.sync = true;
  const rocksdb::Status status = db_->Write(options, batch);
  if (!status.ok()) return WriteError(status, options_.data_dir);
  files_->Commit(revision_, true);
  return absl::OkStatus();
}

}  // namespace hulld::server
