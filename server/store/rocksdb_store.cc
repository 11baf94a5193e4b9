// Writing to a store: commits, copies, and recovery from errors.
#include "server/store/rocksdb_store.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <rocksdb/utilities/checkpoint.h>
#include <rocksdb/write_batch.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <unordered_set>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/process/random_id.h"
#include "server/store/store_errors.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

// Deletes all keys of an incarnation except its record.
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

void PutBase(rocksdb::WriteBatch& batch, const Change& change) {
  const HullRecord& record = change.hull.record;
  const uint64_t incarnation = record.create_revision;
  if (change.previous_layout.base_revision != 0) {
    batch.DeleteRange(IncarnationKey(kBasePrefix, incarnation),
                      BaseKey(incarnation, record.revision, 0));
  }
  if (change.previous_layout.delta_count > 0) {
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

// Returns true if the change deletes or replaces a hull with a damaged record. EncodeChange does
// not find the other values of such a hull.
bool EndsDamagedHull(const Change& change) {
  if (change.body != nullptr) return false;
  if (change.deleted) return change.hull.record.create_revision == 0;
  return change.replaced.has_value() && change.replaced->record.create_revision == 0;
}

}  // namespace

void EncodeChange(rocksdb::WriteBatch& batch, const Change& change) {
  if (change.body != nullptr) {
    const std::string key = BodyKey(change.id());
    if (!change.deleted) return PutSealed(batch, key, EncodeStoredBody(*change.body));
    batch.Delete(key);
    return;
  }
  const HullRecord& record = change.hull.record;
  const std::string hull_key = HullKey(record.hull_id);
  if (change.replaced.has_value()) {
    DropIncarnation(batch, *change.replaced, change.replaced->layout);
  }
  if (change.deleted) {
    batch.Delete(hull_key);
    DropIncarnation(batch, change.hull, change.previous_layout);
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

void PutSealed(rocksdb::WriteBatch& batch, const std::string& key, std::string value) {
  batch.Put(key, Seal(key, std::move(value)));
}

// RocksDB's errors do not distinguish failed syncs from failed writes.
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
  const std::string text = absl::StrCat("cannot read: ", status.ToString());
  if (status.IsCorruption()) return absl::DataLossError(text);
  ++read_failures_;
  return Unavailable(text);
}

// Deletes values of incarnations that have no hull, if kLostKey is set: deleting a hull with a
// damaged record leaves its values behind, because its incarnation is unknown. Nothing is deleted
// while another record is damaged, since the values may belong to that hull. Cost, with kLostKey:
// reads all records, and seeks once per incarnation.
absl::Status RocksDbStore::DropLostIncarnations() {
  const absl::StatusOr<std::optional<std::string>> lost = Read(kLostKey);
  if (absl::IsUnavailable(lost.status())) return lost.status();
  // A damaged mark counts as a mark.
  if (lost.ok() && !lost->has_value()) return absl::OkStatus();
  std::unordered_set<uint64_t> known;
  bool certain = true;
  HULLD_RETURN_IF_ERROR(ForEachRecord(
      [&](const std::string&, const absl::StatusOr<StoredHull>& hull) {
        certain = certain && hull.ok();
        if (hull.ok()) known.insert(hull->record.create_revision);
      },
      [](const auto&...) {}));
  if (!certain) return absl::OkStatus();
  rocksdb::WriteBatch batch;
  for (const char prefix : {kWriterPrefix, kBasePrefix, kDeltaPrefix}) {
    const std::unique_ptr<rocksdb::Iterator> it(db_->NewIterator(rocksdb::ReadOptions()));
    it->Seek(std::string(1, prefix));
    while (it->Valid() && it->key()[0] == prefix) {
      const uint64_t incarnation = IncarnationOf(it->key().ToStringView());
      const std::string end = IncarnationKey(prefix, incarnation + 1);
      if (!known.contains(incarnation)) {
        batch.DeleteRange(IncarnationKey(prefix, incarnation), end);
      }
      it->Seek(end);
    }
    // The next start retries.
    if (!it->status().ok()) return absl::OkStatus();
  }
  batch.Delete(kLostKey);
  return WriteMeta(&batch);
}

absl::Status RocksDbStore::Commit(std::span<Change* const> changes) {
  const uint64_t revision = NumberChanges(changes, revision_);
  rocksdb::WriteBatch batch;
  for (const Change* change : changes) {
    EncodeChange(batch, *change);
    if (EndsDamagedHull(*change)) PutSealed(batch, kLostKey, "");
  }
  PutSealed(batch, kRevisionKey, EncodeNumber(revision));
  rocksdb::WriteOptions options;
  options.sync = options_.durability == Durability::kSync;
  const std::shared_lock lock(db_mutex_);
  const std::lock_guard log_lock(log_mutex_);
  if (!failure_.ok()) return failure_;
  HULLD_RETURN_IF_ERROR(CheckRoom(changes));
  const rocksdb::Status status = db_->Write(options, &batch);
  if (status.ok()) {
    files_->Commit(revision, options.sync);
    revision_ = revision;
    if (!reserve_.is_made()) Compact(changes);
    return absl::OkStatus();
  }
  failure_ = WriteFailed(status);
  // The log may contain all or part of the batch, unsynced.
  const rocksdb::Status cut = files_->CutUncommitted();
  seen_failed_syncs_ = files_->failed_syncs();
  return cut.ok() ? failure_ : OutcomeUnknown(status, cut, options_.data_dir);
}

absl::Status RocksDbStore::CheckRoom(std::span<Change* const> changes) {
  const bool only_deletes =
      std::ranges::all_of(changes, [](const Change* change) { return change->deleted; });
  if (only_deletes || reserve_.is_made()) return absl::OkStatus();
  const rocksdb::IOStatus made = reserve_.Ensure();
  return made.ok() ? absl::OkStatus() : WriteError(made, options_.data_dir);
}

// RocksDB itself would compact only after more changes. If this fails, the disk stays full.
void RocksDbStore::Compact(std::span<Change* const> changes) {
  for (const Change* change : changes) {
    const uint64_t incarnation = change->hull.record.create_revision;
    if (change->body != nullptr || incarnation == 0) continue;
    for (const char prefix : {kBasePrefix, kDeltaPrefix}) {
      const std::string begin = IncarnationKey(prefix, incarnation);
      const std::string end = IncarnationKey(prefix, incarnation + 1);
      const rocksdb::Slice first(begin);
      const rocksdb::Slice last(end);
      const rocksdb::Status compacted =
          db_->CompactRange(rocksdb::CompactRangeOptions(), &first, &last);
      if (!compacted.ok()) {
        spdlog::warn("cannot reclaim the space of deleted records: {}", compacted.ToString());
        return;
      }
    }
  }
}

absl::StatusOr<std::string> RocksDbStore::MakeCopy() {
  const std::string directory =
      absl::StrCat(ScratchDirectory(options_.data_dir), "/copy-", RandomId());
  const std::shared_lock lock(db_mutex_);
  if (db_ == nullptr) return CannotBeRead(options_.data_dir);
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) {
    return Unavailable("cannot create ", directory, " for the copy: ", error.message());
  }
  rocksdb::Checkpoint* created = nullptr;
  rocksdb::Status status = rocksdb::Checkpoint::Create(db_.get(), &created);
  const std::unique_ptr<rocksdb::Checkpoint> checkpoint(created);
  if (status.ok()) status = checkpoint->CreateCheckpoint(DatabaseDirectory(directory));
  if (status.ok()) return directory;
  std::filesystem::remove_all(directory, error);
  return WriteFailed(status);
}

std::optional<StoreDisk> RocksDbStore::disk() const {
  StoreDisk disk;
  std::error_code error;
  std::filesystem::directory_iterator entry(DatabaseDirectory(options_.data_dir), error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    // The file may have been deleted.
    std::error_code gone;
    const uintmax_t bytes = entry->file_size(gone);
    if (gone) continue;
    disk.bytes += bytes;
    if (entry->path().extension() == ".log") disk.log_bytes += bytes;
  }
  const std::filesystem::space_info space = std::filesystem::space(options_.data_dir, error);
  if (!error) disk.free_bytes = space.available;
  // Skipped while the database is reopened, which takes time in proportion to its log.
  const std::shared_lock lock(db_mutex_, std::try_to_lock);
  if (!lock.owns_lock() || db_ == nullptr) return disk;
  uint64_t is_stopped = 0;
  uint64_t delayed_rate = 0;
  db_->GetIntProperty(rocksdb::DB::Properties::kIsWriteStopped, &is_stopped);
  db_->GetIntProperty(rocksdb::DB::Properties::kActualDelayedWriteRate, &delayed_rate);
  disk.is_stalled = is_stopped != 0 || delayed_rate != 0;
  disk.stalls = previous_stalls_ + CountStalls();
  return disk;
}

uint64_t RocksDbStore::CountStalls() const {
  uint64_t stalls = 0;
  std::map<std::string, std::string> statistics;
  db_->GetMapProperty(rocksdb::DB::Properties::kCFStats, &statistics);
  for (const char* const name : {"io_stalls.total_slowdown", "io_stalls.total_stop"}) {
    const auto found = statistics.find(name);
    if (found != statistics.end()) stalls += std::strtoull(found->second.c_str(), nullptr, 10);
  }
  return stalls;
}

// Releases the reserve if the disk was full. Only deletions then succeed until it is restored
// (CheckRoom).
absl::Status RocksDbStore::Recover() {
  {
    const std::lock_guard lock(log_mutex_);
    if (failure_.ok()) return absl::OkStatus();
    if (IsDiskFull(failure_)) reserve_.Release();
  }
  absl::Status recovered = Probe();
  if (recovered.ok()) recovered = Reopen();
  const std::lock_guard lock(log_mutex_);
  failure_ = recovered;
  return recovered;
}

// Returns OK if a file can be written and synced.
absl::Status RocksDbStore::Probe() {
  const std::string scratch = ScratchDirectory(options_.data_dir);
  const std::string path = scratch + "/probe";
  // The next call reports a failure.
  env_->CreateDirIfMissing(scratch).PermitUncheckedError();
  const rocksdb::Status status = rocksdb::WriteStringToFile(
      env_.get(), std::string(size_t{64} << 10, '\0'), path, /*should_sync=*/true);
  env_->DeleteFile(path).PermitUncheckedError();
  return status.ok() ? absl::OkStatus() : WriteFailed(status);
}

// RocksDB resumes by itself after some errors, but not after errors of its log. If the database
// cannot be opened, it is opened for reading.
absl::Status RocksDbStore::Reopen() {
  const std::unique_lock lock(db_mutex_);
  const std::lock_guard log_lock(log_mutex_);
  if (db_ != nullptr) previous_stalls_ += CountStalls();
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
    spdlog::warn("the store in {} accepts writes again", options_.data_dir);
    return opened;
  }
  if (const rocksdb::Status status = OpenForReading(); !status.ok()) {
    spdlog::critical("the store in {} cannot be read: {}", options_.data_dir, status.ToString());
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
    spdlog::error("cannot sync the log in {}: {}", options_.data_dir, status.ToString());
  } else {
    files_->Commit(revision_, true);
  }
  return failure_;
}

void RocksDbStore::SyncInBackground() {
  if (options_.durability == Durability::kRelaxed) SyncLog().IgnoreError();
  files_->SyncMark().PermitUncheckedError();
}

}  // namespace hulld::server
