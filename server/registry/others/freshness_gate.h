#ifndef HULLD_SERVER_REGISTRY_OTHERS_FRESHNESS_GATE_H_
#define HULLD_SERVER_REGISTRY_OTHERS_FRESHNESS_GATE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <functional>
#include <optional>

#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/store/store.h"

namespace hulld::server {

// Blocks calls until the catalog satisfies their freshness. If peer servers commit to the same
// store, the committer queries their changes and applies them before the gate opens. If the store
// is not shared, the catalog is always current, and the gate is open.
//
// Functions with a Locked parameter require the registry's mutex; blocking ones release it. The
// other functions acquire it.
class FreshnessGate {
 public:
  // All must outlive this.
  FreshnessGate(const Store& store, FairMutex& mutex, const Catalog& catalog, Committer& committer)
      : store_(store), mutex_(mutex), catalog_(catalog), committer_(committer) {}
  FreshnessGate(const FreshnessGate&) = delete;
  FreshnessGate& operator=(const FreshnessGate&) = delete;

  // Read barrier: blocks until all changes that peer servers have committed so far are applied.
  // CANCELLED: should_stop, which may be empty, returned true. UNAVAILABLE: the store cannot be
  // queried. Cost: one store query shared by all waiting calls; none if the store is not shared.
  absl::Status AwaitOthers(const std::function<bool()>& should_stop);
  // As above for a thread that holds the mutex. Always goes through the committer, so it waits for
  // earlier submitted changes even if the store is not shared.
  absl::Status AwaitOthers(Locked& locked, const std::function<bool()>& should_stop);

  // Returns the bound on staleness if the catalog satisfies `freshness`, else nullopt. If it will
  // soon be too stale, prefetches from the store so that later reads need not wait.
  std::optional<std::chrono::nanoseconds> TryFresh(const Freshness& freshness);
  std::optional<std::chrono::nanoseconds> TryFresh(Locked& locked, const Freshness& freshness);
  // Blocks until TryFresh succeeds and returns its result. FAILED_PRECONDITION: the store has not
  // assigned that revision. Other errors as AwaitOthers. Cost: a store query only if the catalog is
  // too stale.
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(Locked& locked, const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);

  // If the catalog does not satisfy `freshness`, requests the changes committed by peer servers so
  // far and calls `done` exactly once after they are applied, on this or another thread, without
  // any lock. Returns false and does nothing if it does. UNAVAILABLE: as AwaitOthers.
  bool StartFresh(const Freshness& freshness, std::function<void(const absl::Status&)> done);

  // Runs `next`, on which the answer to a call depends: immediately, or after the changes committed
  // by peer servers so far are applied. Otherwise refuses, without any lock.
  void WhenFresh(Refusal refuse, LockedTask next);

 private:
  // True if no comparison with peer servers is needed.
  bool IsAlwaysFresh(const Freshness& freshness) const {
    return !store_.is_shared() && freshness.at_least_revision == 0;
  }
  void AskAhead(Locked& locked);

  const Store& store_;
  FairMutex& mutex_;
  const Catalog& catalog_;
  Committer& committer_;
  // A prefetch is in flight. Guarded by mutex_.
  bool is_asking_ahead_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_OTHERS_FRESHNESS_GATE_H_
