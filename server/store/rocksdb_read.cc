// Reading from a store: single values, all hulls, a hull's vertices.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <utility>

#include "core/base/status_macros.h"
#include "server/store/rocksdb_store.h"
#include "server/store/store_errors.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

std::string_view View(const rocksdb::Slice& slice) { return {slice.data(), slice.size()}; }

}  // namespace

absl::StatusOr<std::optional<std::string>> RocksDbStore::Read(const std::string& key) {
  std::string sealed;
  rocksdb::Status status;
  {
    const std::shared_lock lock(db_mutex_);
    if (db_ == nullptr) {
      ++read_failures_;
      return CannotBeRead(options_.data_dir);
    }
    status = db_->Get(rocksdb::ReadOptions(), key, &sealed);
    // A block's checksum covers many values; the checksum of the value covers only this one.
    if (status.IsCorruption()) {
      rocksdb::ReadOptions unverified;
      unverified.verify_checksums = false;
      status = db_->Get(unverified, key, &sealed);
    }
  }
  if (status.IsNotFound()) return std::nullopt;
  if (!status.ok()) return ReadFailed(status);
  HULLD_ASSIGN_OR_RETURN(const std::string_view value, Unseal(key, sealed));
  return std::string(value);
}

absl::StatusOr<std::optional<uint64_t>> RocksDbStore::ReadNumber(const std::string& key) {
  HULLD_ASSIGN_OR_RETURN(const std::optional<std::string> value, Read(key));
  if (!value.has_value()) return std::nullopt;
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
  // After a damaged block, the scan continues without checking the checksums of blocks, as in Read.
  for (const bool verify : {true, false}) {
    rocksdb::ReadOptions options;
    options.verify_checksums = verify;
    options.fill_cache = false;
    options.iterate_upper_bound = &upper_bound;
    const std::unique_ptr<rocksdb::Iterator> iterator(db_->NewIterator(options));
    for (iterator->Seek(next); iterator->Valid(); iterator->Next()) {
      HULLD_RETURN_IF_ERROR(visit(View(iterator->key()), View(iterator->value())));
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

absl::Status RocksDbStore::ForEachRecord(const StoredHullVisitor& visit_hull,
                                         const StoredBodyVisitor& visit_body) {
  // After an error in the hulls, doctor still needs the bodies.
  absl::Status read;
  for (const char prefix : {kHullPrefix, kBodyPrefix}) {
    read.Update(ScanRange(std::string(1, prefix), std::string(1, static_cast<char>(prefix + 1)),
                          [&](std::string_view key, std::string_view sealed) {
                            const std::string id(key.substr(1));
                            prefix == kHullPrefix ? visit_hull(id, UnsealStoredHull(id, sealed))
                                                  : visit_body(id, UnsealStoredBody(id, sealed));
                            return absl::OkStatus();
                          }));
  }
  return read;
}

absl::StatusOr<std::vector<Vector>> RocksDbStore::LoadVertices(const StoredHull& hull) {
  VertexAssembly assembly(hull);
  absl::Status status = LoadBase(hull, &assembly);
  if (status.ok()) status = LoadDeltas(hull, &assembly);
  return std::move(assembly).Finish(std::move(status));
}

// Most hulls are one value: a base with a single part, or a single delta. Other hulls and damaged
// values are read one by one, which yields the precise error.
std::vector<absl::StatusOr<std::vector<Vector>>> RocksDbStore::LoadVerticesOfEach(
    std::span<const StoredHull> hulls) {
  std::vector<std::string> keys;
  std::vector<size_t> hull_of;
  for (size_t i = 0; i < hulls.size(); ++i) {
    const HullRecord& record = hulls[i].record;
    const VertexLayout& layout = hulls[i].layout;
    const bool has_one_part = layout.base_vertices > 0 && layout.base_vertices <= kBasePartVertices;
    if (has_one_part && layout.delta_count == 0) {
      keys.push_back(BaseKey(record.create_revision, layout.base_revision, 0));
      hull_of.push_back(i);
    } else if (layout.base_vertices == 0 && layout.delta_count == 1) {
      keys.push_back(DeltaKey(record.create_revision, record.revision));
      hull_of.push_back(i);
    }
  }
  std::vector<absl::StatusOr<std::vector<Vector>>> loaded(
      hulls.size(), absl::NotFoundError("the record has an unexpected number of values"));
  if (const std::shared_lock lock(db_mutex_); db_ != nullptr && !keys.empty()) {
    const std::vector<rocksdb::Slice> slices(keys.begin(), keys.end());
    // May pin parts of the database.
    std::vector<rocksdb::PinnableSlice> values(keys.size());
    std::vector<rocksdb::Status> statuses(keys.size());
    // In the block cache, the blocks of a scan would evict each other before reuse.
    rocksdb::ReadOptions options;
    options.fill_cache = false;
    db_->MultiGet(options, db_->DefaultColumnFamily(), keys.size(), slices.data(), values.data(),
                  statuses.data());
    for (size_t k = 0; k < keys.size(); ++k) {
      if (!statuses[k].ok()) continue;
      const StoredHull& hull = hulls[hull_of[k]];
      const absl::StatusOr<std::string_view> value = Unseal(keys[k], View(values[k]));
      VertexAssembly assembly(hull);
      absl::Status status = hull.layout.delta_count == 0
                                ? assembly.AddBasePart(value)
                                : assembly.AddDelta(hull.record.revision, value);
      loaded[hull_of[k]] = std::move(assembly).Finish(std::move(status));
    }
  }
  for (size_t i = 0; i < hulls.size(); ++i) {
    if (!loaded[i].ok()) loaded[i] = LoadVertices(hulls[i]);
  }
  return loaded;
}

absl::Status RocksDbStore::LoadBase(const StoredHull& hull, VertexAssembly* assembly) {
  while (assembly->wants_base_part()) {
    const absl::StatusOr<std::optional<std::string>> value = Read(
        BaseKey(hull.record.create_revision, hull.layout.base_revision, assembly->next_part()));
    absl::StatusOr<std::string_view> part = absl::DataLossError("it is missing");
    if (!value.ok()) {
      part = value.status();
    } else if (value->has_value()) {
      part = **value;
    }
    HULLD_RETURN_IF_ERROR(assembly->AddBasePart(part));
  }
  return absl::OkStatus();
}

absl::Status RocksDbStore::LoadDeltas(const StoredHull& hull, VertexAssembly* assembly) {
  if (hull.layout.delta_count == 0) return absl::OkStatus();
  const uint64_t incarnation = hull.record.create_revision;
  // A single delta usually belongs to the last change: reading one value costs half as much as a
  // range scan.
  if (hull.layout.delta_count == 1) {
    const absl::StatusOr<std::optional<std::string>> delta =
        Read(DeltaKey(incarnation, hull.record.revision));
    if (delta.ok() && delta->has_value()) return assembly->AddDelta(hull.record.revision, **delta);
    if (!delta.ok() && !absl::IsDataLoss(delta.status())) return delta.status();
  }
  return ScanRange(DeltaKey(incarnation, hull.layout.base_revision + 1),
                   DeltaKey(incarnation, hull.record.revision + 1),
                   [&](std::string_view key, std::string_view sealed) {
                     return assembly->AddDelta(DeltaRevision(key), Unseal(key, sealed));
                   });
}

absl::StatusOr<std::vector<WriterSequence>> RocksDbStore::LoadWriters(const StoredHull& hull) {
  const uint64_t incarnation = hull.record.create_revision;
  const std::string begin = IncarnationKey(kWriterPrefix, incarnation);
  std::vector<WriterSequence> writers;
  const absl::Status status =
      ScanRange(begin, IncarnationKey(kWriterPrefix, incarnation + 1),
                [&](std::string_view key, std::string_view sealed) -> absl::Status {
                  HULLD_ASSIGN_OR_RETURN(const uint64_t sequence,
                                         UnsealSequence(hull.record.hull_id, key, sealed));
                  writers.push_back({std::string(key.substr(begin.size())), sequence});
                  return absl::OkStatus();
                });
  if (!status.ok()) return status;
  return writers;
}

absl::StatusOr<uint64_t> RocksDbStore::LoadSequence(const HullRecord& hull,
                                                    const std::string& writer_id) {
  const absl::StatusOr<std::optional<uint64_t>> sequence =
      ReadNumber(WriterKey(hull.create_revision, writer_id));
  if (absl::IsDataLoss(sequence.status())) {
    return DamagedHull(hull.hull_id,
                       absl::StrCat("a writer's sequence: ", sequence.status().message()));
  }
  if (!sequence.ok()) return sequence.status();
  return sequence->value_or(0);
}

}  // namespace hulld::server
