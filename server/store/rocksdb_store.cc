#include "server/store/rocksdb_store.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <rocksdb/cache.h>
#include <rocksdb/table.h>
#include <rocksdb/utilities/checkpoint.h>
#include <rocksdb/write_batch.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <unordered_set>
#include <utility>

#include "server/contract/error_info.h"
#include "server/contract/status_map.h"
#include "server/process/random_id.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

std::string DatabaseDirectory(const std::string& data_dir) { return data_dir + "/rocksdb"; }

// Ours alone, and nothing in it outlives the server: what else lies in the data directory is not
// ours to touch.
std::string ScratchDirectory(const std::string& data_dir) { return data_dir + "/hulld-scratch"; }

// 'hullctl backup restore' leaves a file of this name in the directory that it makes.
constexpr char kRestoredMark[] = "/restored";

// What a server that was killed left behind.
void ClearScratch(const std::string& data_dir) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(ScratchDirectory(data_dir), error)) {
    std::filesystem::remove_all(entry.path(), error);
  }
}

std::string_view View(const rocksdb::Slice& slice) { return {slice.data(), slice.size()}; }

// What a failed write means for those who wait for it.
absl::Status WriteError(const rocksdb::Status& status, const std::string& data_dir) {
  const std::string cause = status.ToString();
  if (status.IsNoSpace()) {
    return WithReason(
        absl::ResourceExhaustedError(absl::StrCat(
            "the disk that holds --data-dir ", data_dir, " is full (", cause,
            "); nothing was changed; make room and append again, no restart is needed")),
        v1::ERROR_REASON_DISK_FULL);
  }
  return absl::UnavailableError(
      absl::StrCat("cannot write to --data-dir ", data_dir, " (", cause,
                   "); append again once that is repaired, no restart is needed"));
}

absl::Status ReadError(const rocksdb::Status& status, const std::string& what) {
  const std::string text = absl::StrCat(what, ": ", status.ToString());
  if (status.IsCorruption()) return absl::DataLossError(text);
  return absl::UnavailableError(text);
}

absl::Status CannotBeRead(const std::string& data_dir) {
  return absl::UnavailableError(
      absl::StrCat("the store in --data-dir ", data_dir, " cannot be read since an error"));
}

absl::Status OpenError(const rocksdb::Status& status, const std::string& data_dir, bool read_only) {
  const std::string cause = status.ToString();
  if (cause.find("lock") != std::string::npos || cause.find("LOCK") != std::string::npos) {
    return absl::FailedPreconditionError(
        absl::StrCat("--data-dir ", data_dir, " is in use by another hulld (", cause,
                     "); stop that one, or name another directory"));
  }
  if (status.IsCorruption()) {
    return absl::DataLossError(absl::StrCat(
        "--data-dir ", data_dir, " is damaged (", cause,
        "); restore a backup into another directory, or see 'hulld doctor --cut-log'"));
  }
  if (read_only && (status.IsNotFound() || status.IsPathNotFound() || status.IsInvalidArgument())) {
    return absl::NotFoundError(
        absl::StrCat("--data-dir ", data_dir, " holds no store (", cause, ")"));
  }
  return absl::UnavailableError(
      absl::StrCat("cannot open the store in --data-dir ", data_dir, ": ", cause));
}

absl::Status Damaged(const std::string& hull_id, const absl::Status& finding) {
  return WithReason(
      absl::DataLossError(absl::StrCat("hull \"", hull_id, "\" is damaged in the store (",
                                       std::string(finding.message()),
                                       "); delete it and append it anew, or restore a backup")),
      v1::ERROR_REASON_HULL_DAMAGED, {{"hull_id", hull_id}});
}

void PutSealed(rocksdb::WriteBatch& batch, const std::string& key, std::string value) {
  batch.Put(key, Seal(key, std::move(value)));
}

// Deletes all of an incarnation but its record.
void DropIncarnation(rocksdb::WriteBatch& batch, const StoredHull& hull,
                     const VertexLayout& layout) {
  const uint64_t incarnation = hull.record.create_revision;
  const auto drop = [&](char prefix) {
    batch.DeleteRange(IncarnationKey(prefix, incarnation), IncarnationKey(prefix, incarnation + 1));
  };
  if (hull.writer_count > 0) drop(kWriterPrefix);
  if (layout.base_revision != 0) drop(kBasePrefix);
  if (layout.delta_count > 0) drop(kDeltaPrefix);
}

// Whether the change deletes or replaces a hull of which no more than the ID is known, as its
// record is damaged.
bool EndsUnknown(const Change& change) {
  if (change.deleted) return change.hull.record.create_revision == 0;
  return change.replaced.has_value() && change.replaced->record.create_revision == 0;
}

void PutBase(rocksdb::WriteBatch& batch, const Change& change) {
  const HullRecord& record = change.hull.record;
  const uint64_t incarnation = record.create_revision;
  if (change.former_layout.base_revision != 0) {
    batch.DeleteRange(IncarnationKey(kBasePrefix, incarnation),
                      BaseKey(incarnation, record.revision, 0));
  }
  if (change.former_layout.delta_count > 0) {
    batch.DeleteRange(IncarnationKey(kDeltaPrefix, incarnation),
                      DeltaKey(incarnation, record.revision));
  }
  std::span<const Vector> rest = change.vertices;
  for (uint32_t part = 0; !rest.empty(); ++part) {
    const auto vertices = rest.first(std::min(rest.size(), kBasePartVertices));
    PutSealed(batch, BaseKey(incarnation, record.revision, part), EncodeVertices(vertices));
    rest = rest.subspan(vertices.size());
  }
}

void Encode(rocksdb::WriteBatch& batch, const Change& change) {
  const HullRecord& record = change.hull.record;
  const std::string hull_key = HullKey(record.hull_id);
  if (change.replaced.has_value()) {
    DropIncarnation(batch, *change.replaced, change.replaced->layout);
  }
  if (change.deleted) {
    batch.Delete(hull_key);
    DropIncarnation(batch, change.hull, change.former_layout);
    return;
  }
  PutSealed(batch, hull_key, EncodeStoredHull(change.hull));
  if (change.writer.has_value()) {
    PutSealed(batch, WriterKey(record.create_revision, change.writer->writer_id),
              EncodeNumber(change.writer->sequence));
  }
  if (change.vertex_change == VertexChange::kReplaced) PutBase(batch, change);
  if (change.vertex_change == VertexChange::kAdded) {
    PutSealed(batch, DeltaKey(record.create_revision, record.revision),
              EncodeVertices(change.vertices));
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

// What is committed is as durable as the entries of the directories that it is kept in. Those above
// it that are not new are synced too: an earlier start may have made them, and been killed before
// this. Of them some may not be ours to open.
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

// RocksDB's errors do not say whether it was a sync that failed, or when.
void RocksDbStore::CountWriteFailure() {
  const uint64_t failed_syncs = files_->failed_syncs();
  const bool is_sync = seen_failed_syncs_.exchange(failed_syncs) != failed_syncs;
  ++(is_sync ? sync_failures_ : write_failures_);
}

absl::Status RocksDbStore::WriteFailed(const rocksdb::Status& status) {
  CountWriteFailure();
  return WriteError(status, options_.data_dir);
}

absl::Status RocksDbStore::ReadFailed(const rocksdb::Status& status) {
  if (!status.IsCorruption()) ++read_failures_;
  return ReadError(status, "cannot read");
}

absl::Status RocksDbStore::ReadMeta() {
  const absl::StatusOr<uint64_t> format = ReadNumber(kFormatKey);
  if (absl::IsNotFound(format.status())) {
    if (options_.read_only) {
      return absl::NotFoundError(
          absl::StrCat("--data-dir ", options_.data_dir, " holds no store of hulld"));
    }
    if (absl::Status s = InitializeMeta(); !s.ok()) return s;
    return BeginRun();
  }
  if (!format.ok()) return Prefixed("the store's format: ", format.status());
  if (*format > kStoreFormat) {
    return absl::FailedPreconditionError(absl::StrCat(
        "--data-dir ", options_.data_dir, " was written in format ", *format,
        "; this hulld knows format ", kStoreFormat, " at most; run the hulld that wrote it"));
  }
  absl::StatusOr<std::string> id = Read(kStoreIdKey);
  if (!id.ok()) return Prefixed("the store's ID: ", id.status());
  id_ = *std::move(id);
  const absl::StatusOr<uint64_t> revision = ReadNumber(kRevisionKey);
  if (!revision.ok()) return Prefixed("the store's revision: ", revision.status());
  revision_ = *revision;
  return options_.read_only ? absl::OkStatus() : BeginRun();
}

absl::Status RocksDbStore::InitializeMeta() {
  id_ = RandomId();
  rocksdb::WriteBatch batch;
  PutSealed(batch, kFormatKey, EncodeNumber(kStoreFormat));
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
  const std::string mark = options_.data_dir + kRestoredMark;
  const bool restored = std::filesystem::exists(mark, error);
  const absl::StatusOr<std::string> run = Read(kRelaxedKey);
  if (absl::IsUnavailable(run.status())) return run.status();
  const bool cut_short = !absl::IsNotFound(run.status());
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

// Syncs the log with all that was written before. Should that fail, the mark stays.
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

absl::StatusOr<std::string> RocksDbStore::Read(const std::string& key) {
  std::string sealed;
  rocksdb::Status status;
  {
    const std::shared_lock lock(db_mutex_);
    if (db_ == nullptr) {
      ++read_failures_;
      return CannotBeRead(options_.data_dir);
    }
    status = db_->Get(rocksdb::ReadOptions(), key, &sealed);
    // A block's checksum speaks for many values; our own tells whether this one is among the
    // damaged.
    if (status.IsCorruption()) {
      rocksdb::ReadOptions unverified;
      unverified.verify_checksums = false;
      status = db_->Get(unverified, key, &sealed);
    }
  }
  if (status.IsNotFound()) return absl::NotFoundError("the store holds no such key");
  if (!status.ok()) return ReadFailed(status);
  const absl::StatusOr<std::string_view> value = Unseal(key, sealed);
  if (!value.ok()) return value.status();
  return std::string(*value);
}

absl::StatusOr<uint64_t> RocksDbStore::ReadNumber(const std::string& key) {
  const absl::StatusOr<std::string> value = Read(key);
  if (!value.ok()) return value.status();
  return DecodeNumber(*value);
}

// Visits the keys from begin to end and their sealed values.
absl::Status RocksDbStore::ScanRange(
    const std::string& begin, const std::string& end,
    const std::function<absl::Status(std::string_view, std::string_view)>& visit) {
  const std::shared_lock lock(db_mutex_);
  if (db_ == nullptr) {
    ++read_failures_;
    return CannotBeRead(options_.data_dir);
  }
  std::string next = begin;
  const rocksdb::Slice upper_bound(end);
  // As in Read: after damage to a block go on from the last key without the blocks' checksums.
  for (const bool verify : {true, false}) {
    rocksdb::ReadOptions options;
    options.verify_checksums = verify;
    options.fill_cache = false;
    options.iterate_upper_bound = &upper_bound;
    const std::unique_ptr<rocksdb::Iterator> iterator(db_->NewIterator(options));
    for (iterator->Seek(next); iterator->Valid(); iterator->Next()) {
      if (absl::Status s = visit(View(iterator->key()), View(iterator->value())); !s.ok()) return s;
      next.assign(iterator->key().data(), iterator->key().size());
      next.push_back('\0');
    }
    if (iterator->status().ok()) return absl::OkStatus();
    if (!iterator->status().IsCorruption() || !verify) {
      return ReadFailed(iterator->status());
    }
  }
  return absl::OkStatus();
}

absl::Status RocksDbStore::ForEachHull(const StoredHullVisitor& visit) {
  return ScanRange(std::string(1, kHullPrefix), std::string(1, kHullPrefix + 1),
                   [&](std::string_view key, std::string_view sealed) {
                     const std::string hull_id(key.substr(1));
                     const absl::StatusOr<std::string_view> value = Unseal(key, sealed);
                     absl::StatusOr<StoredHull> hull =
                         value.ok() ? DecodeStoredHull(hull_id, *value) : value.status();
                     if (!hull.ok()) hull = Damaged(hull_id, hull.status());
                     visit(hull_id, std::move(hull));
                     return absl::OkStatus();
                   });
}

// Deletes what belongs to no hull. That is left of hulls whose records are damaged, so that their
// incarnations are not known, once they end. While the record of another hull is damaged nothing is
// deleted, as it may be that one's: whoever ends the last of them deletes it all. Reads all
// records, and seeks once for each incarnation.
void RocksDbStore::DropLostIncarnations(const std::set<std::string>& ending,
                                        rocksdb::WriteBatch* batch) {
  std::unordered_set<uint64_t> known;
  bool certain = true;
  const absl::Status read =
      ForEachHull([&](const std::string& hull_id, const absl::StatusOr<StoredHull>& hull) {
        if (ending.contains(hull_id)) return;
        certain = certain && hull.ok();
        if (hull.ok()) known.insert(hull->record.create_revision);
      });
  if (!read.ok() || !certain) return;
  const std::shared_lock lock(db_mutex_);
  if (db_ == nullptr) return;
  for (const char prefix : {kWriterPrefix, kBasePrefix, kDeltaPrefix}) {
    const std::unique_ptr<rocksdb::Iterator> it(db_->NewIterator(rocksdb::ReadOptions()));
    it->Seek(std::string(1, prefix));
    while (it->Valid() && it->key()[0] == prefix) {
      const uint64_t incarnation = IncarnationOf(View(it->key()));
      const std::string end = IncarnationKey(prefix, incarnation + 1);
      if (!known.contains(incarnation)) {
        batch->DeleteRange(IncarnationKey(prefix, incarnation), end);
      }
      it->Seek(end);
    }
  }
}

absl::StatusOr<std::vector<Vector>> RocksDbStore::LoadVertices(const StoredHull& hull) {
  std::vector<Vector> vertices;
  vertices.reserve(hull.layout.base_vertices + hull.layout.delta_vertices);
  absl::Status status = LoadBase(hull, &vertices);
  if (status.ok()) status = LoadDeltas(hull, &vertices);
  if (absl::IsDataLoss(status)) return Damaged(hull.record.hull_id, status);
  if (!status.ok()) return status;
  return vertices;
}

absl::Status RocksDbStore::LoadBase(const StoredHull& hull, std::vector<Vector>* vertices) {
  const uint64_t incarnation = hull.record.create_revision;
  const VertexLayout& layout = hull.layout;
  for (uint32_t part = 0; vertices->size() < layout.base_vertices; ++part) {
    const absl::StatusOr<std::string> value =
        Read(BaseKey(incarnation, layout.base_revision, part));
    const std::string name = absl::StrCat("part ", part, " of its base: ");
    if (absl::IsNotFound(value.status())) {
      return absl::DataLossError(absl::StrCat(name, "it is missing"));
    }
    if (!value.ok()) return Prefixed(name, value.status());
    if (value->empty()) return absl::DataLossError(absl::StrCat(name, "it is empty"));
    if (absl::Status s = AppendVertices(*value, vertices); !s.ok()) return Prefixed(name, s);
  }
  if (vertices->size() == layout.base_vertices) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("its base holds ", vertices->size(), " vertices, not ", layout.base_vertices));
}

absl::Status RocksDbStore::LoadDeltas(const StoredHull& hull, std::vector<Vector>* vertices) {
  const uint64_t incarnation = hull.record.create_revision;
  const VertexLayout& layout = hull.layout;
  const size_t base = vertices->size();
  uint64_t count = 0;
  if (layout.delta_count > 0) {
    const absl::Status scanned = ScanRange(
        DeltaKey(incarnation, layout.base_revision + 1),
        DeltaKey(incarnation, hull.record.revision + 1),
        [&](std::string_view key, std::string_view sealed) {
          const absl::StatusOr<std::string_view> value = Unseal(key, sealed);
          const absl::Status status =
              value.ok() ? AppendVertices(*value, vertices) : value.status();
          ++count;
          return Prefixed(absl::StrCat("its delta of revision ", DeltaRevision(key), ": "), status);
        });
    if (!scanned.ok()) return scanned;
  }
  if (count == layout.delta_count && vertices->size() - base == layout.delta_vertices) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("it has ", count, " deltas with ",
                                          vertices->size() - base, " vertices, not ",
                                          layout.delta_count, " with ", layout.delta_vertices));
}

absl::StatusOr<uint64_t> RocksDbStore::LoadSequence(const HullRecord& hull,
                                                    const std::string& writer_id) {
  const absl::StatusOr<uint64_t> sequence = ReadNumber(WriterKey(hull.create_revision, writer_id));
  if (absl::IsNotFound(sequence.status())) return 0;
  if (absl::IsDataLoss(sequence.status())) {
    return Damaged(hull.hull_id, Prefixed("a writer's sequence: ", sequence.status()));
  }
  return sequence;
}

absl::Status RocksDbStore::Commit(std::span<const Change* const> changes) {
  rocksdb::WriteBatch batch;
  std::set<std::string> unknown;
  for (const Change* change : changes) {
    if (EndsUnknown(*change)) unknown.insert(change->hull.record.hull_id);
  }
  // First, as it is about what was committed before.
  if (!unknown.empty()) DropLostIncarnations(unknown, &batch);
  uint64_t revision = 0;
  for (const Change* change : changes) {
    Encode(batch, *change);
    revision = std::max(revision, change->revision);
  }
  PutSealed(batch, kRevisionKey, EncodeNumber(revision));
  rocksdb::WriteOptions options;
  options.sync = options_.durability == Durability::kSync;
  const std::shared_lock lock(db_mutex_);
  const std::lock_guard log_lock(log_mutex_);
  if (!failure_.ok()) return failure_;
  const rocksdb::Status status = db_->Write(options, &batch);
  if (status.ok()) {
    files_->Commit();
  } else {
    failure_ = WriteFailed(status);
  }
  return failure_;
}

absl::StatusOr<std::string> RocksDbStore::MakeCopy() {
  const std::string directory =
      absl::StrCat(ScratchDirectory(options_.data_dir), "/copy-", RandomId());
  const std::shared_lock lock(db_mutex_);
  if (db_ == nullptr) return CannotBeRead(options_.data_dir);
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) {
    return absl::UnavailableError(
        absl::StrCat("cannot make ", directory, " for the copy: ", error.message()));
  }
  rocksdb::Checkpoint* created = nullptr;
  rocksdb::Status status = rocksdb::Checkpoint::Create(db_.get(), &created);
  const std::unique_ptr<rocksdb::Checkpoint> checkpoint(created);
  if (status.ok()) status = checkpoint->CreateCheckpoint(DatabaseDirectory(directory));
  if (status.ok()) return directory;
  std::filesystem::remove_all(directory, error);
  return WriteFailed(status);
}

absl::Status RocksDbStore::Recover() {
  {
    const std::lock_guard lock(log_mutex_);
    if (failure_.ok()) return absl::OkStatus();
  }
  if (absl::Status s = Probe(); !s.ok()) return s;
  return Reopen();
}

// Whether a file can be written and synced.
absl::Status RocksDbStore::Probe() {
  const std::string scratch = ScratchDirectory(options_.data_dir);
  const std::string path = scratch + "/probe";
  // Should it fail, so will what follows.
  env_->CreateDirIfMissing(scratch).PermitUncheckedError();
  std::unique_ptr<rocksdb::WritableFile> file;
  rocksdb::Status status = env_->NewWritableFile(path, &file, rocksdb::EnvOptions());
  if (status.ok()) status = file->Append(std::string(size_t{64} << 10, '\0'));
  if (status.ok()) status = file->Sync();
  if (status.ok()) status = file->Close();
  file = nullptr;
  env_->DeleteFile(path).PermitUncheckedError();
  return status.ok() ? absl::OkStatus() : WriteFailed(status);
}

// RocksDB can resume by itself after some errors, but not after those of its log. Should opening
// fail, what is kept can still be read.
absl::Status RocksDbStore::Reopen() {
  const std::unique_lock lock(db_mutex_);
  const std::lock_guard log_lock(log_mutex_);
  db_ = nullptr;
  absl::Status opened;
  if (const rocksdb::Status cut = files_->CutUncommitted(); !cut.ok()) {
    opened = WriteFailed(cut);
  } else {
    opened = OpenDb();
    if (!opened.ok()) CountWriteFailure();
  }
  if (opened.ok()) {
    failure_ = absl::OkStatus();
    spdlog::warn("the store in {} can be written again", options_.data_dir);
    return opened;
  }
  rocksdb::DB* db = nullptr;
  const rocksdb::Status status =
      rocksdb::DB::OpenForReadOnly(DbOptions(), DatabaseDirectory(options_.data_dir), &db);
  if (status.ok()) {
    db_.reset(db);
  } else {
    spdlog::critical("the store in {} cannot even be read: {}", options_.data_dir,
                     status.ToString());
  }
  return opened;
}

absl::Status RocksDbStore::SyncLog() {
  const std::shared_lock lock(db_mutex_);
  const std::lock_guard log_lock(log_mutex_);
  if (!failure_.ok() || db_ == nullptr) return failure_;
  const rocksdb::Status status = db_->SyncWAL();
  if (!status.ok() && !status.IsNotSupported()) {
    failure_ = WriteFailed(status);
    spdlog::error("{}", std::string(failure_.message()));
  }
  return failure_;
}

void RocksDbStore::SyncAtIntervals() {
  std::unique_lock lock(sync_mutex_);
  while (!sync_wake_.wait_for(lock, options_.sync_interval, [this] { return ending_; })) {
    lock.unlock();
    SyncLog().IgnoreError();
    lock.lock();
  }
}

}  // namespace hulld::server
