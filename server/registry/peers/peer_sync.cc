#include "server/registry/peers/peer_sync.h"

#include <algorithm>
#include <utility>

#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

using std::chrono::nanoseconds;

PeerSync::PeerSync(RegistryState& state, Committer& committer, PeerFeed& feed)
    : ReadBarrier(state, committer), feed_(feed) {
  committer_.SetPeers(*this);
}

// The pages of the initial load span more than one revision.
absl::Status PeerSync::Begin(Locked& locked, std::vector<PeerChangeListener*> listeners) {
  listeners_ = std::move(listeners);
  const SteadyClock::time_point asked = SteadyClock::now();
  absl::Status fetched = feed_.Fetch();
  Apply(locked, feed_.TakeChanges());
  if (fetched.ok()) NoteSynced(asked);
  feed_.OnPeerCommit([this] { committer_.AddBarrier([](Locked&, const absl::Status&) {}); });
  return fetched;
}

std::optional<nanoseconds> PeerSync::TryFresh(Locked& locked, const Freshness& freshness) {
  if (!ReadBarrier::TryFresh(locked, freshness).has_value()) return std::nullopt;
  if (!synced_at_.has_value()) return std::nullopt;
  const SteadyClock::time_point began =
      freshness.began.has_value() ? *freshness.began : SteadyClock::now();
  const nanoseconds staleness = std::max<nanoseconds>(began - *synced_at_, nanoseconds(0));
  if (!freshness.max_staleness.has_value()) return staleness;
  if (staleness > *freshness.max_staleness) return std::nullopt;
  if (staleness > *freshness.max_staleness / 2) FetchAhead();
  return staleness;
}

void PeerSync::FetchAhead() {
  if (std::exchange(is_fetching_ahead_, true)) return;
  committer_.AddBarrier([this](Locked&, const absl::Status&) { is_fetching_ahead_ = false; });
}

void PeerSync::StartFetch(std::function<void(const absl::Status&)> done) {
  Locked locked(state_.mutex);
  committer_.StartBarrier(locked,
                          [done = std::move(done)](Locked& later, const absl::Status& status) {
                            later.Afterwards([done, status] { done(status); });
                          });
}

void PeerSync::WhenFresh(Refusal refuse, LockedTask next) {
  Locked locked(state_.mutex);
  committer_.AddBarrier([refuse = std::move(refuse), next = std::move(next)](
                            Locked& later, const absl::Status& status) {
    if (status.ok()) return next(later);
    later.Afterwards([refuse, status] { refuse(status); });
  });
}

std::vector<HullGrowth> PeerSync::GrownHulls(const PeerChanges& changes) const {
  std::vector<HullGrowth> grown;
  uint64_t points = 0;
  const HullTable::Entries& all = state_.hulls.entries();
  for (const auto& [id, change] : changes.by_id) {
    if (!change.hull.has_value() || !change.hull->ok()) continue;
    const auto found = all.find(id);
    if (found == all.end() || found->second.awake() == nullptr) continue;
    const RegisteredHull& hull = *found->second.awake();
    const StoredHull& stored = **change.hull;
    if (!hull.GrewInto(stored)) continue;
    points += stored.layout.delta_vertices - hull.committed().layout.delta_vertices;
    if (grown.size() == kMaxGrownHulls || points > kMaxGrowth) break;
    grown.push_back({hull.committed(), stored});
  }
  return grown;
}

void PeerSync::Apply(Locked& locked, const PeerChanges& changes) {
  std::vector<std::pair<uint64_t, const std::string*>> in_order;
  in_order.reserve(changes.by_id.size());
  for (const auto& [id, change] : changes.by_id) in_order.emplace_back(change.revision, &id);
  std::ranges::sort(in_order);
  const uint64_t since = state_.revision();
  for (const auto& [revision, id] : in_order) {
    const auto hull = state_.ApplyPeerChange(locked, *id, changes.by_id.at(*id), since);
    for (PeerChangeListener* const each : listeners_) each->OnPeerChange(locked, *id, hull);
    state_.hulls.RestSome(locked);
    state_.bodies.DropSome(locked);
  }
  if (state_.is_cache() && changes.revision > 0) state_.SetTotals(changes.totals);
  if (changes.revision > state_.revision()) state_.ApplyOther(locked, changes.revision);
  state_.memory.Evict(locked);
  // Tasks deferred by these tasks wait for the next changes.
  for (const LockedTask& task : std::exchange(deferred_, {})) task(locked);
}

}  // namespace hulld::server
