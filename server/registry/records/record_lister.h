#ifndef HULLD_SERVER_REGISTRY_RECORDS_RECORD_LISTER_H_
#define HULLD_SERVER_REGISTRY_RECORDS_RECORD_LISTER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <string>

#include "server/process/worker_pool.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/change_feed.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/records/record_gate.h"
#include "server/store/store.h"

namespace hulld::server {

// Lists hulls and bodies if the store finds records and the catalog holds only a part: queries the
// store one page after another, without adding to the catalog. If the catalog knows more about the
// same version of a hull than its record (its box, or its damage), the page includes that.
//
// Each page is at one revision, which the catalog reaches before the page is returned (RecordGate).
// Guarded by the registry's mutex, which is released during store queries.
class RecordLister {
 public:
  // All must outlive this. loaders: threads that read for watches.
  RecordLister(Store& store, FairMutex& mutex, const Catalog& catalog, MemoryBudget& memory,
               ChangeFeed& feed, RecordGate& gate, WorkerPool& loaders)
      : store_(store),
        mutex_(mutex),
        catalog_(catalog),
        memory_(memory),
        feed_(feed),
        gate_(gate),
        loaders_(loaders) {}
  RecordLister(const RecordLister&) = delete;
  RecordLister& operator=(const RecordLister&) = delete;

  // As Registry::List and ListBodies. Query the store on this thread. Require that the thread does
  // not hold the mutex (not checked: a mutex does not know its holder).
  absl::StatusOr<HullPage> ListHulls(const std::string& prefix, const std::string& after,
                                     size_t page_size, const std::function<bool()>& should_stop);
  absl::StatusOr<BodyPage> ListBodies(const std::string& prefix, const std::string& after,
                                      size_t page_size, const std::function<bool()>& should_stop);

  // Takes the next piece of a watch in stage kPresent and advances the watch. If the piece is not
  // read yet, starts the read, and the watch waits for it. UNAVAILABLE: the read failed; the next
  // call retries.
  absl::Status TakePresent(Locked& locked, ChangeWatch& watch, WatchPiece* piece);

 private:
  absl::StatusOr<FoundRecords> List(const std::string& prefix, const std::string& after,
                                    size_t page_size, RecordKinds kinds,
                                    const std::function<bool()>& should_stop);
  HullChange Describe(const std::string& id, const absl::StatusOr<StoredHull>& stored) const;
  void ReadPresent(Locked& locked, ChangeWatch& watch);

  Store& store_;
  FairMutex& mutex_;
  const Catalog& catalog_;
  MemoryBudget& memory_;
  ChangeFeed& feed_;
  RecordGate& gate_;
  WorkerPool& loaders_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_RECORDS_RECORD_LISTER_H_
