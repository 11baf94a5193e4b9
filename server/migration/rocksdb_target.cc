#include <rocksdb/write_batch.h>

#include <utility>

#include "core/base/status_macros.h"
#include "server/migration/migration.h"
#include "server/store/rocksdb_store.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

class RocksDbTarget : public MigrationTarget {
 public:
  explicit RocksDbTarget(std::unique_ptr<RocksDbStore> store) : store_(std::move(store)) {}

  Store& store() override { return *store_; }

  absl::StatusOr<std::optional<MigrationSource>> ReadMark() override {
    HULLD_ASSIGN_OR_RETURN(const std::optional<std::string> mark, store_->ReadMigrationMark());
    if (!mark.has_value()) return std::nullopt;
    const std::string& value = *mark;
    const size_t bytes = EncodeNumber(0).size();
    HULLD_ASSIGN_OR_RETURN(const uint64_t revision, DecodeNumber(value.substr(0, bytes)));
    return MigrationSource{value.substr(bytes), revision};
  }

  absl::Status Begin(const MigrationSource& source) override {
    rocksdb::WriteBatch batch;
    for (const char prefix : {kHullPrefix, kWriterPrefix, kBasePrefix, kDeltaPrefix, kBodyPrefix}) {
      batch.DeleteRange(std::string(1, prefix), std::string(1, static_cast<char>(prefix + 1)));
    }
    PutSealed(batch, kMigrationKey, EncodeNumber(source.revision) + source.store_id);
    return store_->Import(&batch);
  }

  absl::Status Add(std::span<const Change* const> changes) override {
    rocksdb::WriteBatch batch;
    for (const Change* change : changes) EncodeChange(batch, *change);
    return store_->Import(&batch);
  }

  absl::Status Finish(const MigrationSource& source) override {
    rocksdb::WriteBatch batch;
    PutSealed(batch, kRevisionKey, EncodeNumber(source.revision));
    batch.Delete(kMigrationKey);
    return store_->Import(&batch);
  }

 private:
  const std::unique_ptr<RocksDbStore> store_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenRocksDbTarget(const std::string& data_dir) {
  RocksDbOptions options;
  options.data_dir = data_dir;
  options.migrating = true;
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<RocksDbStore> store,
                         RocksDbStore::Open(std::move(options)));
  return std::make_unique<RocksDbTarget>(std::move(store));
}

}  // namespace hulld::server
