#include <absl/strings/str_cat.h>
#include <rocksdb/write_batch.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/migration/migration.h"
#include "server/store/postgres/batch_statements.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/postgres/session.h"
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

// Writes through the session of the store's commits, fenced by the epoch of its claim.
class PostgresTarget : public MigrationTarget {
 public:
  explicit PostgresTarget(std::unique_ptr<PostgresStore> store) : store_(std::move(store)) {}

  Store& store() override { return *store_; }

  absl::StatusOr<std::optional<MigrationSource>> ReadMark() override {
    HULLD_ASSIGN_OR_RETURN(const bool is_marked, HasTable(store_->writer(), "hulld.migration"));
    if (!is_marked) return std::nullopt;
    HULLD_ASSIGN_OR_RETURN(
        const Rows rows,
        store_->writer().Execute({.text = "SELECT store_id, revision FROM hulld.migration"}));
    if (rows.count() != 1) return absl::DataLossError("the row of hulld.migration is missing");
    return MigrationSource{std::string(rows.at(0, 0)), rows.bigint(0, 1)};
  }

  absl::Status Begin(const MigrationSource& source) override {
    std::vector<Statement> statements;
    for (const char* text :
         {"DELETE FROM hulld.hulls", "DELETE FROM hulld.bodies", "DELETE FROM hulld.writers",
          "DELETE FROM hulld.bases", "DELETE FROM hulld.deltas",
          "UPDATE hulld.store SET hulls = 0, vertices = 0, bodies = 0",
          "DROP TABLE IF EXISTS hulld.migration",
          "CREATE TABLE hulld.migration (store_id text NOT NULL, revision bigint NOT NULL)",
          "PREPARE migrate_begin(text, bigint) AS INSERT INTO hulld.migration VALUES ($1, $2)"}) {
      statements.push_back({.text = text});
    }
    statements.push_back(
        {.name = "migrate_begin", .parameters = {source.store_id, EncodeBigint(source.revision)}});
    statements.push_back({.text = "DEALLOCATE migrate_begin"});
    return Transact(std::move(statements), store_->revision(), {});
  }

  absl::Status Add(std::span<const Change* const> changes) override {
    return Transact(StatementsOf(changes), store_->revision(), AddedBy(changes));
  }

  absl::Status Finish(const MigrationSource& source) override {
    return Transact({{.text = "DROP TABLE hulld.migration"}}, source.revision, {});
  }

 private:
  // revision: of the store after the transaction. added: change of its totals.
  absl::Status Transact(std::vector<Statement> statements, uint64_t revision,
                        const StoreTotals& added) {
    std::vector<Statement> all = {{.text = "BEGIN"}, store_->Fence(revision, added)};
    std::ranges::move(statements, std::back_inserter(all));
    all.push_back({.text = "COMMIT"});
    absl::Status status = store_->writer().ExecuteCommit(all).status();
    if (status.ok()) return status;
    if (ViolatedConstraint(status) == "store_fence") {
      return absl::AbortedError(
          "a server took over the database; stop it, then run this command again");
    }
    return absl::Status(status.code(), absl::StrCat("the database: ", status.message()));
  }

  const std::unique_ptr<PostgresStore> store_;
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

absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenPostgresTarget(const std::string& conninfo) {
  PostgresOptions options;
  options.conninfo = conninfo;
  options.migrating = true;
  options.should_stop = [] { return true; };
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<PostgresStore> store,
                         PostgresStore::Open(std::move(options)));
  return std::make_unique<PostgresTarget>(std::move(store));
}

}  // namespace hulld::server
