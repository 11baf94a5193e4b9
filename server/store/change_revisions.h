#ifndef HULLD_SERVER_STORE_CHANGE_REVISIONS_H_
#define HULLD_SERVER_STORE_CHANGE_REVISIONS_H_

#include <cstdint>
#include <span>

#include "server/store/store.h"

namespace hulld::server {

// Assigns revisions to changes, in order, in their records, layouts, and bodies. revision: the
// store's revision before the first change. Returns the revision after the last. Can be repeated
// with another revision until the changes are committed. Cost: O(1) each.
uint64_t NumberChanges(std::span<Change* const> changes, uint64_t revision);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_CHANGE_REVISIONS_H_
