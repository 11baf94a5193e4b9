#ifndef HULLD_SERVER_REGISTRY_WATCH_PAGE_SOURCE_H_
#define HULLD_SERVER_REGISTRY_WATCH_PAGE_SOURCE_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/store/store.h"

namespace hulld::server {

// Requests the existing records with a prefix, or the one with an ID, in the order of IDs.
struct PageRequest {
  // Ignored unless `ids` is empty.
  std::string prefix = {};
  // At most one ID.
  std::vector<std::string> ids = {};
  RecordKinds kinds = {};
  // The page begins after this ID.
  std::string after = {};
  size_t page_size = 0;
};

// Existing hulls and bodies by ID, each of kind PRESENT, including damaged ones.
struct RecordPage {
  uint64_t store_revision = 0;
  std::vector<HullChange> entries = {};
  // True if more hulls or bodies follow.
  bool more = false;
};

// Reads the committed hulls and bodies page by page. Guarded by the registry's mutex.
class PageSource {
 public:
  // Calls `done` exactly once with the mutex held: before ReadPage returns if the catalog contains
  // all records, otherwise later, on another thread. The page includes every change up to the
  // feed's revision at the time `done` is called, or up to a later one. UNAVAILABLE: the store
  // cannot be read.
  virtual void ReadPage(Locked& locked, PageRequest request,
                        std::function<void(Locked&, absl::StatusOr<RecordPage>)> done) = 0;

 protected:
  ~PageSource() = default;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_WATCH_PAGE_SOURCE_H_
