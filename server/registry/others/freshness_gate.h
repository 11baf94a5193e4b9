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

// Lets a call go on once the catalog is as fresh as the call asks. Where other servers commit to
// the same store, it has the committer ask the store what they did; the answer is taken over before
// the gate opens. Where the store is not shared, the catalog is always up to date, and every gate
// is open.
//
// The functions that take a Locked require the registry's mutex; those that may wait release it
// meanwhile. The others take it themselves.
class FreshnessGate {
 public:
  // All must outlive this.
  FreshnessGate(const Store& store, FairMutex& mutex, const Catalog& catalog, Committer& committer)
      : store_(store), mutex_(mutex), catalog_(catalog), committer_(committer) {}
  FreshnessGate(const FreshnessGate&) = delete;
  FreshnessGate& operator=(const FreshnessGate&) = delete;

  // Waits until all that other servers had committed by now is taken over. CANCELLED: should_stop,
  // which may be empty, said so. UNAVAILABLE: the store cannot be asked. Cost: a question to the
  // store, one for all that wait; nothing where it is not shared.
  absl::Status AwaitOthers(const std::function<bool()>& should_stop);
  // The same for a thread that holds the mutex. The committer is asked whether the store is shared
  // or not: then this waits for the changes that were submitted before.
  absl::Status AwaitOthers(Locked& locked, const std::function<bool()>& should_stop);

  // Where what is here is as fresh as this: how stale it may be; otherwise nullopt. A read that is
  // content, but would soon not be, has the store asked for the reads to come, so that none of them
  // waits.
  std::optional<std::chrono::nanoseconds> TryFresh(const Freshness& freshness);
  std::optional<std::chrono::nanoseconds> TryFresh(Locked& locked, const Freshness& freshness);
  // Waits for that, and returns the same. FAILED_PRECONDITION: the store has not given that
  // revision. Otherwise as AwaitOthers. Cost: a question to the store only where it is not so yet.
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(Locked& locked, const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);

  // Has what other servers had committed by now taken over, and calls `done` then, once, on this
  // or another thread, without any lock. UNAVAILABLE: as AwaitOthers.
  void StartFollow(std::function<void(const absl::Status&)> done);
  // The same where what is here is not as fresh as this; false, and nothing, where it is.
  bool StartFresh(const Freshness& freshness, std::function<void(const absl::Status&)> done);

  // Goes on with something that the answer to a call depends on: at once, or once what other
  // servers had committed by now is taken over. Otherwise refuses, without any lock.
  void WhenFresh(Refusal refuse, LockedTask next);

 private:
  // Whether what is here needs no comparing with what others did.
  bool IsAlwaysFresh(const Freshness& freshness) const {
    return !store_.is_shared() && freshness.at_least_revision == 0;
  }
  void AskAhead(Locked& locked);

  const Store& store_;
  FairMutex& mutex_;
  const Catalog& catalog_;
  Committer& committer_;
  // The store is being asked for reads to come. Guarded by mutex_.
  bool is_asking_ahead_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_OTHERS_FRESHNESS_GATE_H_
