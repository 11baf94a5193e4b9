#ifndef HULLD_SERVER_STORE_OTHER_CHANGES_H_
#define HULLD_SERVER_STORE_OTHER_CHANGES_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/numeric/vector.h"
#include "server/store/body_record.h"
#include "server/store/hull_record.h"

namespace hulld::server {

// Peers' changes of one ID.
struct OtherChange {
  // Revision of the latest change: that of the present hull or body, or the one at which it ended.
  uint64_t revision = 0;
  // Revision at which the latest incarnation ended; 0: none ended.
  uint64_t ended_at = 0;
  // create_revision of the first incarnation that ended, or 0 if none ended or it is unknown; and
  // its kind.
  uint64_t former_began = 0;
  bool former_was_body = false;
  // The present hull or body, if any. DATA_LOSS: it is damaged.
  std::optional<absl::StatusOr<StoredHull>> hull;
  std::optional<absl::StatusOr<StoredBody>> body;
  // Points that turn the known version of the hull into the present one (Store::LoadGrowth). None:
  // the hull must be read again.
  std::optional<std::vector<Vector>> growth;
};

// Numbers of stored objects.
struct StoreTotals {
  uint64_t hulls = 0;
  uint64_t vertices = 0;
  uint64_t bodies = 0;
};

// Changes that peers committed to a shared store (Store::is_shared), up to a revision.
struct OtherChanges {
  // That revision; 0: no new changes.
  uint64_t revision = 0;
  std::map<std::string, OtherChange> by_id;
  // Totals at that revision, if Store::finds_records().
  StoreTotals totals;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_OTHER_CHANGES_H_
