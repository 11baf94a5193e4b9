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

// Opens watches, and gives each what it is told next. A watch passes through three stages: what
// went since it was told last, where it resumes; what is there, in the order of IDs; and what
// changes, which the ChangeFeed notes. What is there is taken from the catalog, or from the store
// where the catalog knows only a part (RecordReader).
//
// Invariant: what changes while a watch is told what is there is told after it, so nothing is
// missed. Takes the registry's mutex, for some ten microseconds at a time.
class Watches {
 public:
  // All must outlive this. The mutex is the registry's.
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

  // As in Registry.
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
