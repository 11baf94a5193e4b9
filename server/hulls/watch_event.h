#ifndef HULLD_SERVER_HULLS_WATCH_EVENT_H_
#define HULLD_SERVER_HULLS_WATCH_EVENT_H_

#include <optional>
#include <utility>

#include "core/query/box_tree.h"
#include "server/registry/catalog/registry_types.h"

namespace hulld::server {

// Returns a change with the current record and box of its hull. Returns none if the hull is a later
// incarnation, of which the kind of the change may be false; a later batch reports that
// incarnation.
inline std::optional<HullChange> AtCurrentState(HullChange change, const HullRecord& record,
                                                const Box& box) {
  const bool is_same = record.create_revision == change.record.create_revision;
  if (!is_same && change.kind != ChangeKind::kPresent) return std::nullopt;
  change.record = record;
  change.box = box;
  return change;
}

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_WATCH_EVENT_H_
