#ifndef HULLD_SERVER_REGISTRY_PEERS_PEER_SYNC_H_
#define HULLD_SERVER_REGISTRY_PEERS_PEER_SYNC_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "server/process/synchronization.h"
#include "server/registry/commit/committer.h"
#include "server/registry/peers/read_barrier.h"
#include "server/store/peer_feed.h"

namespace hulld::server {

// Follows the commits of peer servers to the same store, applies them to the registry's state, and
// is the read barrier. Exists only if the store has a PeerFeed.
//
// Changes are applied on the committer's thread, after the superseded local changes were refused,
// so no local change to the same IDs is being committed. A thread may still build a chunk on such a
// hull, or read its record; the state of the hull, or of the reading, shows that it was superseded.
// Tasks that depend on a changed ID run after all changes of the same fetch are applied (Defer).
class PeerSync : public ReadBarrier, public Committer::Peers {
 public:
  // Maximum number of hulls that grow by peer servers' points within one hold of the mutex, and of
  // their points in total; takes a few milliseconds.
  static constexpr size_t kMaxGrownHulls = 1 << 10;
  static constexpr uint64_t kMaxGrowth = 1 << 16;

  // All must outlive this. Registers with the committer.
  PeerSync(RegistryState& state, Committer& committer, PeerFeed& feed);

  absl::Status Begin(Locked& locked, std::vector<PeerChangeListener*> listeners) override;
  void End() override { feed_.OnPeerCommit(nullptr); }

  bool has_peers() const override { return true; }
  using ReadBarrier::AwaitPeers;
  using ReadBarrier::TryFresh;
  absl::Status AwaitPeers(Locked& locked, const std::function<bool()>& should_stop) override {
    return AwaitCommits(locked, should_stop);
  }
  // If the registry will soon be too stale, fetches ahead, so that later reads need not wait.
  std::optional<std::chrono::nanoseconds> TryFresh(Locked& locked,
                                                   const Freshness& freshness) override;
  void StartFetch(std::function<void(const absl::Status&)> done) override;
  void WhenFresh(Refusal refuse, LockedTask next) override;
  void Defer(LockedTask task) override { deferred_.push_back(std::move(task)); }

  // Returns the hulls in memory that only grew, up to the limits of a single hold of the mutex. The
  // committed state does not change before Apply, because the same thread calls both.
  std::vector<HullGrowth> GrownHulls(const PeerChanges& changes) const override;
  void Apply(Locked& locked, const PeerChanges& changes) override;
  void NoteSynced(SteadyClock::time_point asked) override { synced_at_ = asked; }

 private:
  void FetchAhead();

  PeerFeed& feed_;
  std::vector<PeerChangeListener*> listeners_;
  // The registry's mutex guards the members below.
  std::vector<LockedTask> deferred_;
  // Time at which the last answered query was sent; all commits of peer servers before it are
  // applied. nullopt before the first query.
  std::optional<SteadyClock::time_point> synced_at_;
  bool is_fetching_ahead_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_PEERS_PEER_SYNC_H_
