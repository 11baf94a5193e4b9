#ifndef HULLD_SERVER_REGISTRY_PEERS_PEER_SYNC_H_
#define HULLD_SERVER_REGISTRY_PEERS_PEER_SYNC_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/process/synchronization.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/state/registry_state.h"
#include "server/store/store.h"

namespace hulld::server {

// Keeps the registry in step with the peer servers over one database: follows their commits,
// applies them to the state, and blocks calls until the state satisfies their freshness. If the
// store has no PeerFeed, the registry is always current, and nothing blocks.
//
// Peer changes are applied on the committer's thread, after the superseded local changes were
// refused, so no local change to the same IDs is being committed. A thread may still build a chunk
// on such a hull, or read its record; the state of the hull, or of the read, shows that it was
// superseded. Tasks that depend on a changed ID run after all changes of the same fetch are applied
// (Defer).
//
// Functions with a Locked parameter require the registry's mutex; blocking ones release it. The
// other functions acquire it.
class PeerSync : public Committer::Peers {
 public:
  // Maximum number of hulls that grow by peer servers' points in one critical section, and of their
  // points in total; takes a few milliseconds.
  static constexpr size_t kMaxGrownHulls = 1 << 10;
  static constexpr uint64_t kMaxGrowth = 1 << 16;

  // Both must outlive this. Registers with the committer.
  PeerSync(RegistryState& state, Committer& committer);
  PeerSync(const PeerSync&) = delete;
  PeerSync& operator=(const PeerSync&) = delete;

  // True if a peer server may change an ID before a change submitted here commits; that change is
  // then retried.
  bool has_peers() const { return feed_ != nullptr; }

  // Called after a peer server's change of the ID was applied, to defer the tasks that wait for the
  // ID. hull: the known hull that the change updated or ended, or null.
  using OnChange = std::function<void(const std::string& id, const HullPointer& hull)>;
  // Applies the peer changes since the initial load, and follows the feed until End. Call once,
  // before the first change.
  absl::Status Begin(Locked& locked, OnChange on_change);
  void End();

  // Read barrier: blocks until all changes that peer servers committed before the call are applied.
  // Required before functions without a freshness parameter (RecordReader::List,
  // RecordReader::FindBodies). Not for gRPC threads. CANCELLED: should_stop, which may be empty,
  // returned true. UNAVAILABLE: the store cannot be queried. Cost: one store query, shared by all
  // waiting calls; none without peer servers.
  absl::Status AwaitPeers(const std::function<bool()>& should_stop);
  absl::Status AwaitPeers(Locked& locked, const std::function<bool()>& should_stop);

  // Returns the bound on staleness if the registry satisfies `freshness`, else nullopt. If the
  // registry will soon be too stale, fetches ahead, so that later reads need not wait.
  std::optional<std::chrono::nanoseconds> TryFresh(const Freshness& freshness);
  std::optional<std::chrono::nanoseconds> TryFresh(Locked& locked, const Freshness& freshness);
  // Blocks until TryFresh succeeds and returns its result. FAILED_PRECONDITION: the store has not
  // assigned that revision. Other errors: see AwaitPeers. Cost: a store query, only if the registry
  // is too stale.
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);
  absl::StatusOr<std::chrono::nanoseconds> AwaitFresh(Locked& locked, const Freshness& freshness,
                                                      const std::function<bool()>& should_stop);
  // Requests the changes committed by peer servers so far and calls `done` exactly once after they
  // are applied, on this or another thread, without holding a lock. Does not block. Errors and
  // cost: see AwaitPeers.
  void StartFetch(std::function<void(const absl::Status&)> done);
  // Runs `next`, which determines the answer to a call, once all changes that peer servers have
  // committed so far are applied. On an error, calls `refuse` without holding a lock.
  void WhenFresh(Refusal refuse, LockedTask next);
  // Returns a function that runs `next`, or calls `refuse` with the error, without holding a lock.
  static Committer::Barrier RunOrRefuse(Refusal refuse, LockedTask next);

  // Defers a task, which depends on an ID that a peer server changed, until that change is applied.
  // Requires has_peers().
  void Defer(LockedTask task);

  // Returns the hulls in memory that only grew, up to kMaxGrownHulls and kMaxGrowth. The committed
  // state does not change before Apply, because the same thread calls both.
  std::vector<HullGrowth> GrownHulls(const PeerChanges& changes) const override;
  void Apply(Locked& locked, const PeerChanges& changes) override;
  void NoteSynced(SteadyClock::time_point queried_at) override { synced_at_ = queried_at; }

 private:
  RegistryState& state_;
  Committer& committer_;
  // Null without peer servers.
  PeerFeed* const feed_;
  OnChange on_change_;
  // The registry's mutex guards the members below.
  std::vector<LockedTask> deferred_;
  // Time at which the last answered query was sent; all commits of peer servers before it are
  // applied. nullopt before the first query.
  std::optional<SteadyClock::time_point> synced_at_;
  bool is_fetching_ahead_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_PEERS_PEER_SYNC_H_
