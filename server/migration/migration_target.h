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

// What is copied: a store as of a revision.
struct MigrationSource {
  std::string store_id;
  uint64_t revision = 0;

  friend bool operator==(const MigrationSource&, const MigrationSource&) = default;
};

// A store that is being filled by a migration. A mark in it names the source from Begin to Finish;
// no hulld opens a store with that mark. Each call is one transaction: all of it is on disk when it
// returns, or nothing is there.
class MigrationTarget {
 public:
  virtual ~MigrationTarget() = default;

  // What is there, to be read.
  virtual Store& store() = 0;
  // The mark; none where no migration is under way.
  virtual absl::StatusOr<std::optional<MigrationSource>> ReadMark() = 0;
  // Drops all that is there, and sets the mark.
  virtual absl::Status Begin(const MigrationSource& source) = 0;
  // Keeps changes with the revisions that they have.
  virtual absl::Status Add(std::span<const Change* const> changes) = 0;
  // The store has the revision of its source from now on, and no mark.
  virtual absl::Status Finish(const MigrationSource& source) = 0;
};

// INVALID_ARGUMENT, FAILED_PRECONDITION, UNAVAILABLE: as RocksDbStore::Open.
absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenRocksDbTarget(const std::string& data_dir);
// As PostgresStore::Open; CANCELLED: a server is active over it. slots: as PostgresOptions::slots.
absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenPostgresTarget(const std::string& conninfo,
                                                                    const std::string& slots = "");

}  // namespace hulld::server

#endif  // HULLD_SERVER_MIGRATION_MIGRATION_TARGET_H_
