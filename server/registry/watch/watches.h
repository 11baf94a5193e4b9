#ifndef HULLD_SERVER_REGISTRY_WATCH_WATCHES_H_
#define HULLD_SERVER_REGISTRY_WATCH_WATCHES_H_

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/change_feed.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/records/record_reader.h"
#include "server/store/store.h"

namespace hulld::server {

// Opens watches and takes their next pieces. A watch passes through three stages: the deletions
// since its last report, if it resumes; the existing hulls, in the order of IDs; and the changes,
// which the ChangeFeed notes. Existing hulls come from the catalog, or from the store if the
// catalog holds only a part (RecordReader).
//
// Invariant: a change during the list is reported after it, so none is missed. Holds the registry's
// mutex for some ten microseconds per step.
class Watches {
 public:
  // All must outlive this. `mutex` is the registry's.
  Watches(const Store& store, FairMutex& mutex, Catalog& catalog, MemoryBudget& memory,
          ChangeFeed& feed, RecordReader& lister)
      : store_(store),
        mutex_(mutex),
        catalog_(catalog),
        memory_(memory),
        feed_(feed),
        lister_(lister) {}
  Watches(const Watches&) = delete;
  Watches& operator=(const Watches&) = delete;

  // Implement the functions of Registry with these names.
  absl::StatusOr<std::shared_ptr<ChangeWatch>> Open(const WatchTarget& target,
                                                    const WatchStart& start,
                                                    std::function<void()> on_ready);
  absl::StatusOr<WatchPiece> Take(ChangeWatch& watch);
  void Extend(ChangeWatch& watch, std::span<const std::string> added,
              std::span<const std::string> dropped);
  void Nudge(const std::shared_ptr<ChangeWatch>& watch);
  void Close(const std::shared_ptr<ChangeWatch>& watch);
  void EndAll();

 private:
  void TakePresent(ChangeWatch& watch, WatchPiece* piece);

  const Store& store_;
  FairMutex& mutex_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  ChangeFeed& feed_;
  RecordReader& lister_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_WATCH_WATCHES_H_
