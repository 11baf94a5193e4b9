#ifndef HULLD_SERVER_MIGRATION_MIGRATION_H_
#define HULLD_SERVER_MIGRATION_MIGRATION_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "server/migration/migration_target.h"
#include "server/store/store.h"

namespace hulld::server {

struct MigrationCounts {
  uint64_t hulls = 0;
  uint64_t bodies = 0;
  // How many of these hulls and bodies an earlier run had copied.
  uint64_t resumed = 0;
};

// Copies all that a store holds: hulls with their revisions, counts and vertices, their writers'
// sequences, and bodies; then compares. What it reads of hulls and bodies at once, but for
// vertices, is kept in memory: some 200 bytes a hull.
class Migration {
 public:
  // Told how many of how many hulls and bodies are done.
  using Progress = std::function<void(uint64_t done, uint64_t all)>;

  // Reads what hulls and bodies there are. The source must outlive this, and must not change.
  // DATA_LOSS naming the first hull or body that is damaged.
  static absl::StatusOr<Migration> Read(Store& source, Progress progress);

  // Copies what the target does not have yet, in byte order of the IDs, all of a hull at once; so a
  // run that was ended anywhere can be continued. FAILED_PRECONDITION, without changing anything:
  // the target is a store of its own, or of a migration from another store. DATA_LOSS: a hull of
  // the source is damaged. Others: as the target's.
  absl::StatusOr<MigrationCounts> CopyTo(MigrationTarget& target);

  // Reads everything back, from both. DATA_LOSS naming the first hull or body that is not the same:
  // its record and revisions, its vertices bit by bit, its writers' sequences, its pieces.
  absl::Status Compare(Store& copy) const;

  const MigrationSource& source() const { return as_of_; }

 private:
  Migration(Store& source, Progress progress);

  absl::Status Prepare(MigrationTarget& target);
  absl::Status CopyHulls(MigrationTarget& target, MigrationCounts* counts);
  absl::Status CopyBodies(MigrationTarget& target, MigrationCounts* counts);
  absl::StatusOr<std::vector<Change>> ChangesOf(const StoredHull& hull) const;
  absl::Status CompareHull(Store& copy, const StoredHull& hull, const StoredHull& other) const;
  uint64_t all() const { return hulls_.size() + bodies_.size(); }

  Store* source_;
  Progress progress_;
  MigrationSource as_of_;
  // In byte order of the IDs.
  std::vector<StoredHull> hulls_;
  std::vector<StoredBody> bodies_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_MIGRATION_MIGRATION_H_
