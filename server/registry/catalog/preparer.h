#ifndef HULLD_SERVER_REGISTRY_CATALOG_PREPARER_H_
#define HULLD_SERVER_REGISTRY_CATALOG_PREPARER_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "server/process/metrics.h"
#include "server/process/worker_pool.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"

namespace hulld::server {

// Prepares a hull after queries have paid for it (LiveHull::WantsPreparing), or before it contains
// too many points that are no longer vertices. Runs on its own thread, which no call waits for, or
// on the thread of a reader that expects enough queries.
//
// Invariant: at most one thread prepares a hull, or is about to (RegisteredHull::is_preparing).
// Guarded by the registry's mutex, which is released during preparation.
class Preparer {
 public:
  // All must outlive this. metrics: metrics of the queue of hulls to prepare.
  Preparer(FairMutex& mutex, Catalog& catalog, MemoryBudget& memory,
           std::optional<PoolMetrics> metrics)
      : mutex_(mutex), catalog_(catalog), memory_(memory), thread_(std::in_place, 1, metrics) {}
  Preparer(const Preparer&) = delete;
  Preparer& operator=(const Preparer&) = delete;

  // True if past and expected queries pay for preparation of the hull, and no thread prepares it.
  static bool IsWanted(const RegisteredHull& hull, uint64_t expected_questions);
  // Prepares the committed state of a hull. Releases the mutex. Requires: the hull has points in
  // memory, and no thread prepares it.
  void Prepare(Locked& locked, RegisteredHull& hull);
  // Prepares the hull on the preparer's thread. Requires: no thread prepares it.
  void Schedule(const HullPointer& hull);
  // As Schedule if most points of the hull are no longer vertices; does nothing if a thread
  // prepares it.
  void ScheduleIfWorn(const HullPointer& hull);

  // Stops further preparation.
  void Stop(const Locked& locked);
  // Ends the thread. Call after Stop, without the mutex.
  void End() { thread_.reset(); }

 private:
  FairMutex& mutex_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  // Guarded by mutex_.
  bool is_stopped_ = false;
  // One thread, to leave the CPUs to calls.
  std::optional<WorkerPool> thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_PREPARER_H_
