#ifndef HULLD_SERVER_REGISTRY_PEERS_READ_BARRIER_H_
#define HULLD_SERVER_REGISTRY_PEERS_READ_BARRIER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/state/registry_state.h"

namespace hulld::server {

// A part of the registry in which tasks wait for IDs.
class PeerChangeListener {
 public:
  virtual ~PeerChangeListener() = default;
  // Defers the tasks that wait for the ID, after a peer server's change of it was applied. hull:
  // the known hull that the change updated or ended, or null.
  virtual void OnPeerChange(Locked& locked, const std::string& id, const HullPointer& hull) = 0;
};

// Blocks calls until the registry satisfies their freshness. This class is the barrier of a store
// without peer servers, which is always current; PeerSync overrides it.
//
// Functions with a Locked parameter require the registry's mutex; blocking ones release it. The
// other functions acquire it.
class ReadBarrier {
 public:
  // Both must outlive this.
  ReadBarrier(RegistryState& state, Committer& committer) : state_(state), committer_(committer) {}
  ReadBarrier(const ReadBarrier&) = delete;
  ReadBarrier& operator=(const ReadBarrier&) = delete;
  virtual ~ReadBarrier() = default;

  // True if a peer server may change an ID before a submitted change of it commits; the change is
  // then retried.
  virtual bool has_peers() const { return false; }

  // Applies the peer changes since the initial load, and follows the feed until End. listeners: in
  // the order of notification. Call once, before the first change.
  virtual absl::Status Begin(Locked& /*locked*/, std::vector<PeerChangeListener*> /*listeners*/) {
    return absl::OkStatus();
  }
  virtual void End() {}

  // Blocks until all changes that were submitted here, or committed by peer servers, before the
  // call are applied. CANCELLED: should_stop, which may be empty, returned true. UNAVAILABLE: the
  // store cannot be queried. Cost: one store query, shared by all waiting calls.
  absl::Status AwaitCommits(Locked& locked, const std::function<bool()>& should_stop);

  // Read barrier: blocks until all changes that peer servers committed before the call are applied.
  // Required before functions without a freshness parameter (Registry::List, BodyRegistry::Find).
  // Not for gRPC threads. Errors and cost as AwaitCommits; no effect without peer servers.
  absl::Status AwaitPeers(const std::function<bool()>& should_stop);
  virtual absl::Status AwaitPeers(Locked& /*locked*/,
                                  const std::function<bool()>& /*should_stop*/) {
    return absl::OkStatus();
  }

  // Returns the bound on staleness if the registry satisfies `freshness`, else nullopt.
  std::optional<std::chrono::nanoseconds> TryFresh(const Freshness& freshness);
  virtual std::optional<std::chrono::nanoseconds> TryFresh(Locked& locked,
                                                           const Freshness& freshness);
  // Blocks until TryFresh succeeds and returns its result. FAILED_PRECONDITION: the store has not
  // assigned that revision. Other errors as AwaitPeers. Cost: a store query only if the registry is
  // too stale.
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(Locked& locked, const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);
  // Requests the changes committed by peer servers so far and calls `done` exactly once after they
  // are applied, on this or another thread, without holding a lock. Errors and cost as AwaitPeers,
  // without blocking.
  virtual void StartFetch(std::function<void(const absl::Status&)> done) { done(absl::OkStatus()); }
  // Runs `next`, which determines the answer to a call, after the changes committed by peer servers
  // so far are applied; or calls `refuse` with the error, without holding a lock.
  virtual void WhenFresh(Refusal refuse, LockedTask next);

  // Defers a task, which depends on an ID that a peer server changed, until that change is applied.
  // Requires has_peers().
  virtual void Defer(LockedTask task);

 protected:
  RegistryState& state_;
  Committer& committer_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_PEERS_READ_BARRIER_H_
