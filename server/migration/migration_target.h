#ifndef HULLD_SERVER_MIGRATION_MIGRATION_TARGET_H_
#define HULLD_SERVER_MIGRATION_MIGRATION_TARGET_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "server/store/store.h"

namespace hulld::server {

// Source of a copy: a store at a revision.
struct MigrationSource {
  std::string store_id;
  uint64_t revision = 0;

  friend bool operator==(const MigrationSource&, const MigrationSource&) = default;
};

// A store being filled by a migration. From Begin to Finish, a mark in it names the source; hulld
// refuses to open a store with that mark. Each call is one transaction: on return, either all of
// its changes are on disk or none.
class MigrationTarget {
 public:
  virtual ~MigrationTarget() = default;

  // The target, for reading.
  virtual Store& store() = 0;
  // Returns the mark; nullopt if no migration is in progress.
  virtual absl::StatusOr<std::optional<MigrationSource>> ReadMark() = 0;
  // Drops the contents and sets the mark.
  virtual absl::Status Begin(const MigrationSource& source) = 0;
  // Stores changes with their existing revisions.
  virtual absl::Status Add(std::span<const Change* const> changes) = 0;
  // Sets the revision of the source and removes the mark.
  virtual absl::Status Finish(const MigrationSource& source) = 0;
};

// INVALID_ARGUMENT, FAILED_PRECONDITION, UNAVAILABLE: as RocksDbStore::Open.
absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenRocksDbTarget(const std::string& data_dir);
// As PostgresStore::Open; CANCELLED: a server is active on the database.
absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenPostgresTarget(const std::string& conninfo);

}  // namespace hulld::server

#endif  // HULLD_SERVER_MIGRATION_MIGRATION_TARGET_H_
