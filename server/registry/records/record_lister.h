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

// Lists what there is, where the store finds records and the catalog knows only a part: asks the
// store for a page at a time, and makes nothing known. Where the catalog knows more of the same
// version of a hull than its record (its box, or that it is damaged), that is told.
//
// Every page is of one revision, which the catalog has reached before the page is told
// (RecordGate). Guarded by the registry's mutex, which is not held while the store is asked.
class RecordLister {
 public:
  // All must outlive this. loaders: threads that read what watches are told.
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

  // As Registry::List and ListBodies. Ask the store on this thread. Require that the mutex is not
  // held (unchecked: a mutex does not tell which thread holds it).
  absl::StatusOr<HullPage> ListHulls(const std::string& prefix, const std::string& after,
                                     size_t page_size, const std::function<bool()>& should_stop);
  absl::StatusOr<BodyPage> ListBodies(const std::string& prefix, const std::string& after,
                                      size_t page_size, const std::function<bool()>& should_stop);

  // Takes what a watch of the stage kPresent is told next, and moves the watch on. Where that is
  // not read yet, has it read, and the watch waits until it is. UNAVAILABLE: it could not be read;
  // the next call tries again.
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
