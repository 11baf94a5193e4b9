#ifndef HULLD_SERVER_MIGRATION_MIGRATION_H_
#define HULLD_SERVER_MIGRATION_MIGRATION_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace hulld::server {

// The source of a copy: a store at a revision.
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

// INVALID_ARGUMENT, FAILED_PRECONDITION, UNAVAILABLE: see RocksDbStore::Open.
absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenRocksDbTarget(const std::string& data_dir);
// Like PostgresStore::Open; CANCELLED: a server is active on the database.
absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenPostgresTarget(const std::string& conninfo);

struct MigrationCounts {
  uint64_t hulls = 0;
  uint64_t bodies = 0;
  // Number of these hulls and bodies copied by an earlier run.
  uint64_t resumed = 0;
};

// Copies the contents of a store: hulls with their revisions, counts and vertices, their writers'
// sequences, and bodies; then compares. Keeps all records of hulls and bodies, without vertices, in
// memory: about 200 bytes per hull.
class Migration {
 public:
  // Receives the number of hulls and bodies done, and the total.
  using Progress = std::function<void(uint64_t done, uint64_t all)>;

  // Reads the records of hulls and bodies. The source must outlive this and must not change.
  // DATA_LOSS, naming the first damaged hull or body.
  static absl::StatusOr<Migration> Read(Store& source, Progress progress);

  // Copies the hulls and bodies missing in the target, each as a whole, in byte order of the IDs.
  // An interrupted run can therefore be resumed. FAILED_PRECONDITION, without any change: the
  // target is a complete store, or belongs to a migration from another store. DATA_LOSS: a hull of
  // the source is damaged, or the source lacks records or has records later than its revision.
  // Other errors: as the target's.
  absl::StatusOr<MigrationCounts> CopyTo(MigrationTarget& target);

  // Returns true if the target is a finished copy of the source's current state. Compares both
  // stores if they have the same revision.
  absl::StatusOr<bool> IsFinished(MigrationTarget& target) const;

  // Reads both stores back and compares them. DATA_LOSS, naming the first hull or body that
  // differs: its record and revisions, its vertices bit by bit, its writers' sequences, its
  // pieces.
  absl::Status Compare(Store& copy) const;

  const MigrationSource& source() const { return as_of_; }

 private:
  Migration(Store& source, Progress progress);

  absl::Status CheckSource() const;
  absl::Status Prepare(MigrationTarget& target);
  absl::StatusOr<std::vector<Change>> ChangesOf(const StoredHull& hull) const;
  absl::StatusOr<std::vector<Change>> ChangesOf(const StoredBody& body) const;
  absl::Status CompareHull(Store& copy, const StoredHull& hull, const StoredHull& other) const;
  uint64_t all() const { return hulls_.size() + bodies_.size(); }

  Store* source_;
  Progress progress_;
  MigrationSource as_of_;
  // In byte order of the IDs.
  std::vector<StoredHull> hulls_;
  std::vector<StoredBody> bodies_;
};

// 'hulld migrate': copies a store that no server has open to another store, of the same kind or
// another, and compares the two. arguments: the command line after "migrate". Prints progress and
// results to `out`, and errors to `err`. Returns the exit status of the process: 0 if everything is
// copied and equal, 1 if it failed midway and can be resumed, 2 if it was refused and changed
// nothing.
int RunMigrate(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err);

}  // namespace hulld::server

#endif  // HULLD_SERVER_MIGRATION_MIGRATION_H_
