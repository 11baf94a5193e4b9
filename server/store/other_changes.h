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

// What other servers made of one ID.
struct OtherChange {
  // The store's revision at the last change that can be seen: the revision of what there is by now,
  // or the one at which it ended.
  uint64_t revision = 0;
  // The revision at which an incarnation ended last; 0: none did.
  uint64_t ended_at = 0;
  // create_revision of the first incarnation that ended, and whether it was a body's; 0: none did,
  // or that is not known.
  uint64_t former_began = 0;
  bool former_was_body = false;
  // What there is by now: one of the two, or nothing. DATA_LOSS: it is damaged.
  std::optional<absl::StatusOr<StoredHull>> hull;
  std::optional<absl::StatusOr<StoredBody>> body;
  // The points that make the hull that is known here what there is by now, where they were asked
  // for (Store::LoadGrowth) and could be had. Otherwise the hull is to be read anew.
  std::optional<std::vector<Vector>> growth;
};

// What a store holds, counted.
struct StoreTotals {
  uint64_t hulls = 0;
  uint64_t vertices = 0;
  uint64_t bodies = 0;
};

// What other servers committed to a store that is shared (Store::is_shared), up to a moment.
struct OtherChanges {
  // The store's revision at that moment; 0: there is nothing that was not known.
  uint64_t revision = 0;
  std::map<std::string, OtherChange> by_id;
  // What the store held at that moment, where it finds records (Store::finds_records).
  StoreTotals totals;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_OTHER_CHANGES_H_
