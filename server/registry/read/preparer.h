#ifndef HULLD_SERVER_REGISTRY_READ_PREPARER_H_
#define HULLD_SERVER_REGISTRY_READ_PREPARER_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "server/process/metrics.h"
#include "server/process/worker_pool.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"

namespace hulld::server {

struct RegisteredHull;

// Prepares hulls: once questions about a hull have paid for it (LiveHull::WantsPreparing), and
// where a hull would otherwise come to hold many points that are no vertices any more. A thread of
// its own does it, for which nobody waits, or a reader that expects to ask that much.
//
// Invariant: one thread at a time prepares a hull, or is about to: RegisteredHull::preparing.
// Guarded by the registry's mutex, which is released while a hull is prepared.
class Preparer {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // All must outlive this. metrics: where to report what waits to be prepared.
  Preparer(FairMutex& mutex, Catalog& catalog, MemoryBudget& memory,
           std::optional<PoolMetrics> metrics)
      : mutex_(mutex), catalog_(catalog), memory_(memory), thread_(std::in_place, 1, metrics) {}
  Preparer(const Preparer&) = delete;
  Preparer& operator=(const Preparer&) = delete;

  // Whether questions have paid for preparing what they look through, these included that a reader
  // expects to ask, and nobody does it yet.
  static bool IsWanted(const RegisteredHull& hull, uint64_t expected_questions);
  // Prepares what is committed of a hull. Releases the mutex meanwhile. Requires that the hull has
  // points in memory, and that nobody prepares it.
  void Prepare(Locked& locked, RegisteredHull& hull);
  // Has the thread do it. Requires that nobody prepares the hull.
  void Schedule(const HullPointer& hull);
  // The same where most points of the hull are no vertices any more, unless somebody does it.
  void ScheduleIfWorn(const HullPointer& hull);

  // Nothing more is prepared from now on.
  void Stop(const Locked& locked);
  // Ends the thread. After Stop, without the mutex.
  void End() { thread_.reset(); }

 private:
  FairMutex& mutex_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  // Guarded by mutex_.
  bool is_stopped_ = false;
  // One thread: what it does is in nobody's way.
  std::optional<WorkerPool> thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_READ_PREPARER_H_
