// How a store is opened: its directories, its format, and what the last run left.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <rocksdb/cache.h>
#include <rocksdb/table.h>
#include <rocksdb/write_batch.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <utility>

#include "server/contract/status_map.h"
#include "server/process/random_id.h"
#include "server/store/change_encoding.h"
#include "server/store/data_directory.h"
#include "server/store/rocksdb_store.h"
#include "server/store/store_errors.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

// What a server that was killed left behind.
void ClearScratch(const std::string& data_dir) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(ScratchDirectory(data_dir), error)) {
    std::filesystem::remove_all(entry.path(), error);
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<RocksDbStore>> RocksDbStore::Open(RocksDbOptions options) {
  if (options.data_dir.empty()) {
    return absl::InvalidArgumentError("--data-dir is empty; name the directory of the store");
  }
  std::unique_ptr<RocksDbStore> store(new RocksDbStore(std::move(options)));
  if (!store->options_.read_only) {
    if (absl::Status s = store->MakeDirectories(); !s.ok()) return s;
  }
  if (absl::Status s = store->OpenDb(); !s.ok()) return s;
  if (absl::Status s = store->ReadMeta(); !s.ok()) return s;
  if (!store->options_.read_only) ClearScratch(store->options_.data_dir);
  if (store->options_.durability == Durability::kRelaxed && !store->options_.read_only) {
    store->syncer_ = std::thread([raw = store.get()] { raw->SyncAtIntervals(); });
  }
  return store;
}

RocksDbStore::RocksDbStore(RocksDbOptions options) : options_(std::move(options)) {
  rocksdb::Env* base = options_.env != nullptr ? options_.env : rocksdb::Env::Default();
  files_ =
      std::make_shared<LogFileSystem>(base->GetFileSystem(), DatabaseDirectory(options_.data_dir));
  env_ = rocksdb::NewCompositeEnv(files_);
}

RocksDbStore::~RocksDbStore() {
  {
    const std::lock_guard lock(sync_mutex_);
    ending_ = true;
  }
  sync_wake_.notify_all();
  if (syncer_.joinable()) syncer_.join();
  if (relaxed_run_ && db_ != nullptr) EndRelaxedRun().IgnoreError();
  // Once more, if what a failed write left could not be cut off when it failed.
  db_ = nullptr;
  if (failure_.ok() || files_->CutUncommitted().ok()) return;
  spdlog::error("the log in {} may hold changes that were refused", options_.data_dir);
}

rocksdb::Options RocksDbStore::DbOptions() const {
  rocksdb::Options options;
  options.env = env_.get();
  options.create_if_missing = !options_.read_only;
  options.paranoid_checks = true;
  // A record that the end of its log cuts short is dropped: if the disk keeps what it synced, the
  // record was being written, and a store that syncs had not acknowledged it. All else that does
  // not match its checksum is refused, what was not synced when the power went out too (in a store
  // that syncs, the last record at most): its pages may have reached the disk in another order, but
  // it may as well have been acknowledged and damaged since, and the log does not tell which.
  options.wal_recovery_mode = options_.cut_log
                                  ? rocksdb::WALRecoveryMode::kPointInTimeRecovery
                                  : rocksdb::WALRecoveryMode::kTolerateCorruptedTailRecords;
  // Coordinates do not compress, and what is not compressed can be read around damage.
  options.compression = rocksdb::kNoCompression;
  options.write_buffer_size = 16 << 20;
  options.max_total_wal_size = 256 << 20;
  options.max_background_jobs = 2;
  options.max_open_files = 256;
  options.keep_log_file_num = 4;
  options.max_log_file_size = 4 << 20;
  options.info_log_level = rocksdb::InfoLogLevel::WARN_LEVEL;
  rocksdb::BlockBasedTableOptions table;
  table.checksum = rocksdb::kXXH3;
  table.format_version = 5;
  // Hulls are cached by the registry.
  table.block_cache = rocksdb::NewLRUCache(8 << 20);
  options.table_factory.reset(rocksdb::NewBlockBasedTableFactory(table));
  return options;
}

// A commit is only as durable as the entries of the directories that hold it. Directories above
// that are not new are synced too: an earlier start may have made them, and been killed before
// this. We may not be allowed to open some of those.
absl::Status RocksDbStore::MakeDirectories() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path database =
      fs::absolute(DatabaseDirectory(options_.data_dir), error).lexically_normal();
  // What a start makes once the directories are durable.
  if (env_->FileExists((database / "CURRENT").string()).ok()) return absl::OkStatus();
  const auto failure = [this](const fs::path& path, const rocksdb::Status& status) {
    return absl::UnavailableError(absl::StrCat("cannot make --data-dir ", options_.data_dir, ": ",
                                               path.string(), ": ", status.ToString()));
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
    const rocksdb::Status synced = SyncDirectory(path);
    if (!synced.ok()) return failure(path, synced);
  }
  for (fs::path path = above;; path = path.parent_path()) {
    const rocksdb::Status synced = SyncDirectory(path);
    const bool ours = path == above || path == database.parent_path();
    if (!synced.ok() && ours) return failure(path, synced);
    if (path == path.root_path()) return absl::OkStatus();
  }
}

// Makes the entries of a directory durable.
rocksdb::Status RocksDbStore::SyncDirectory(const std::string& path) {
  std::unique_ptr<rocksdb::Directory> directory;
  const rocksdb::Status opened = env_->NewDirectory(path, &directory);
  return opened.ok() ? directory->Fsync() : opened;
}

absl::Status RocksDbStore::OpenDb() {
  const std::string directory = DatabaseDirectory(options_.data_dir);
  rocksdb::DB* db = nullptr;
  const rocksdb::Status status = options_.read_only
                                     ? rocksdb::DB::OpenForReadOnly(DbOptions(), directory, &db)
                                     : rocksdb::DB::Open(DbOptions(), directory, &db);
  if (!status.ok()) return OpenError(status, options_.data_dir, options_.read_only);
  db_.reset(db);
  return absl::OkStatus();
}

absl::Status RocksDbStore::ReadMeta() {
  const absl::StatusOr<std::optional<uint64_t>> format = ReadNumber(kFormatKey);
  if (!format.ok()) return Prefixed("the store's format: ", format.status());
  if (!format->has_value()) {
    if (options_.read_only) {
      return absl::NotFoundError(
          absl::StrCat("--data-dir ", options_.data_dir, " holds no store of hulld"));
    }
    if (absl::Status s = InitializeMeta(); !s.ok()) return s;
    return BeginRun();
  }
  if (**format > kStoreFormat) {
    return absl::FailedPreconditionError(absl::StrCat(
        "--data-dir ", options_.data_dir, " was written in format ", **format,
        "; this hulld knows format ", kStoreFormat, " at most; run the hulld that wrote it"));
  }
  const absl::StatusOr<std::optional<std::string>> mark = ReadMigrationMark();
  if (absl::IsUnavailable(mark.status())) return mark.status();
  // A damaged mark is one.
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
  if (absl::Status s = BeginRun(); !s.ok()) return s;
  return DropLostIncarnations();
}

absl::Status RocksDbStore::InitializeMeta() {
  id_ = RandomId();
  rocksdb::WriteBatch batch;
  PutSealed(batch, kFormatKey, EncodeNumber(kFormatWithoutBodies));
  PutSealed(batch, kStoreIdKey, id_);
  PutSealed(batch, kRevisionKey, EncodeNumber(0));
  return WriteMeta(&batch);
}

// Before anything else is served or written. A store that may have lost what it had acknowledged
// takes an ID of its own, as the revisions of what is lost will be given to other changes: one that
// was made of a backup, one whose log is cut, and one that ended relaxed without syncing its log.
// The new ID and the marks in the database change together, and the mark in the directory goes
// last: a start that was interrupted is repeated by the next.
absl::Status RocksDbStore::BeginRun() {
  std::error_code error;
  const std::string mark = RestoredMark(options_.data_dir);
  const bool restored = std::filesystem::exists(mark, error);
  const absl::StatusOr<std::optional<std::string>> run = Read(kRelaxedKey);
  if (absl::IsUnavailable(run.status())) return run.status();
  // A damaged mark is one.
  const bool cut_short = !run.ok() || run->has_value();
  const bool relaxed = options_.durability == Durability::kRelaxed;
  const std::string former_id = id_;
  rocksdb::WriteBatch batch;
  if (options_.cut_log || restored || cut_short) {
    id_ = RandomId();
    PutSealed(batch, kStoreIdKey, id_);
  }
  if (relaxed) PutSealed(batch, kRelaxedKey, "");
  if (!relaxed && cut_short) batch.Delete(kRelaxedKey);
  if (batch.Count() > 0) {
    if (absl::Status s = WriteMeta(&batch); !s.ok()) return s;
  }
  relaxed_run_ = relaxed;
  if (restored &&
      (!std::filesystem::remove(mark, error) || !SyncDirectory(options_.data_dir).ok())) {
    return absl::UnavailableError(absl::StrCat("cannot remove ", mark));
  }
  if (restored) {
    spdlog::info("restored from a backup of store {} at revision {}; this is store {}", former_id,
                 revision_, id_);
  } else if (cut_short) {
    spdlog::warn(
        "store {} was open with --durability=relaxed and was not closed: what it acknowledged "
        "last may be lost; at revision {} this is store {}",
        former_id, revision_, id_);
  }
  return absl::OkStatus();
}

// Syncs the log with all that was written before. If that fails, the mark stays.
absl::Status RocksDbStore::EndRelaxedRun() {
  if (absl::Status s = SyncLog(); !s.ok()) return s;
  rocksdb::WriteBatch batch;
  batch.Delete(kRelaxedKey);
  return WriteMeta(&batch);
}

absl::Status RocksDbStore::WriteMeta(rocksdb::WriteBatch* batch) {
  rocksdb::WriteOptions options;
  options.sync = true;
  const rocksdb::Status status = db_->Write(options, batch);
  if (!status.ok()) return WriteError(status, options_.data_dir);
  files_->Commit();
  return absl::OkStatus();
}

}  // namespace hulld::server
