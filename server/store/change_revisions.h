#ifndef HULLD_SERVER_STORE_CHANGE_REVISIONS_H_
#define HULLD_SERVER_STORE_CHANGE_REVISIONS_H_

#include <cstdint>
#include <span>

#include "server/store/store.h"

namespace hulld::server {

// Gives changes their revisions, in their order, and writes them wherever a change speaks of them:
// in the record and the layout of its hull, and in its body. revision: the store's before the first
// of them. Returns that after the last. May be done again, with another revision, until the changes
// are committed. Cost: O(1) each.
uint64_t NumberChanges(std::span<Change* const> changes, uint64_t revision);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_CHANGE_REVISIONS_H_
