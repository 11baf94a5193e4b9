#include "server/registry/peers/peer_sync.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {
namespace {

using std::chrono::nanoseconds;

absl::Status FutureRevision(uint64_t wanted, uint64_t current) {
  return WithReason(
      absl::FailedPreconditionError(absl::StrCat(
          "freshness.at_least_revision is ", wanted, ", but the store is at revision ", current,
          " and has issued no later one; use the revision of a reply's header")),
      v1::ERROR_REASON_FUTURE_REVISION,
      {{"at_least_revision", wanted}, {"current_revision", current}});
}

}  // namespace

PeerSync::PeerSync(RegistryState& state, Committer& committer)
    : state_(state), committer_(committer), feed_(state.store.peers()) {
  committer_.SetPeers(*this);
}

// The pages of the initial load span more than one revision.
absl::Status PeerSync::Begin(Locked& locked, OnChange on_change) {
  if (!has_peers()) return absl::OkStatus();
  on_change_ = std::move(on_change);
  const SteadyClock::time_point queried_at = SteadyClock::now();
  absl::Status fetched = feed_->Fetch();
  Apply(locked, feed_->TakeChanges());
  if (fetched.ok()) NoteSynced(queried_at);
  feed_->OnPeerCommit([this] { committer_.AddBarrier([](Locked&, const absl::Status&) {}); });
  return fetched;
}

void PeerSync::End() {
  if (has_peers()) feed_->OnPeerCommit(nullptr);
}

absl::Status PeerSync::AwaitPeers(const std::function<bool()>& should_stop) {
  if (!has_peers()) return absl::OkStatus();
  Locked locked(state_.mutex);
  return AwaitPeers(locked, should_stop);
}

absl::Status PeerSync::AwaitPeers(Locked& locked, const std::function<bool()>& should_stop) {
  if (!has_peers()) return absl::OkStatus();
  return locked.AwaitCall(should_stop,
                          [&](const auto& done) { committer_.StartBarrier(locked, done); });
}

std::optional<nanoseconds> PeerSync::TryFresh(const Freshness& freshness) {
  if (!has_peers() && freshness.at_least_revision == 0) return nanoseconds(0);
  Locked locked(state_.mutex);
  return TryFresh(locked, freshness);
}

std::optional<nanoseconds> PeerSync::TryFresh(Locked& /*locked*/, const Freshness& freshness) {
  if (state_.revision() < freshness.at_least_revision) return std::nullopt;
  if (!has_peers()) return nanoseconds(0);
  if (!synced_at_.has_value()) return std::nullopt;
  const SteadyClock::time_point began =
      freshness.began.has_value() ? *freshness.began : SteadyClock::now();
  const nanoseconds staleness = std::max<nanoseconds>(began - *synced_at_, nanoseconds(0));
  if (!freshness.max_staleness.has_value()) return staleness;
  if (staleness > *freshness.max_staleness) return std::nullopt;
  if (staleness > *freshness.max_staleness / 2 && !std::exchange(is_fetching_ahead_, true)) {
    committer_.AddBarrier([this](Locked&, const absl::Status&) { is_fetching_ahead_ = false; });
  }
  return staleness;
}

absl::StatusOr<nanoseconds> PeerSync::AwaitFresh(const Freshness& freshness,
                                                 const std::function<bool()>& should_stop) {
  Locked locked(state_.mutex);
  return AwaitFresh(locked, freshness, should_stop);
}

absl::StatusOr<nanoseconds> PeerSync::AwaitFresh(Locked& locked, const Freshness& freshness,
                                                 const std::function<bool()>& should_stop) {
  if (const auto staleness = TryFresh(locked, freshness)) return *staleness;
  HULLD_RETURN_IF_ERROR(AwaitPeers(locked, should_stop));
  const uint64_t revision = state_.revision();
  if (revision >= freshness.at_least_revision) return nanoseconds(0);
  return FutureRevision(freshness.at_least_revision, revision);
}

void PeerSync::StartFetch(std::function<void(const absl::Status&)> done) {
  if (!has_peers()) return done(absl::OkStatus());
  Locked locked(state_.mutex);
  committer_.StartBarrier(locked,
                          [done = std::move(done)](Locked& later, const absl::Status& status) {
                            later.Defer([done, status] { done(status); });
                          });
}

void PeerSync::WhenFresh(Refusal refuse, LockedTask next) {
  Locked locked(state_.mutex);
  if (!has_peers()) return next(locked);
  committer_.AddBarrier(RunOrRefuse(std::move(refuse), std::move(next)));
}

Committer::Barrier PeerSync::RunOrRefuse(Refusal refuse, LockedTask next) {
  return [refuse = std::move(refuse), next = std::move(next)](Locked& locked,
                                                              const absl::Status& status) {
    if (status.ok()) return next(locked);
    locked.Defer([refuse, status] { refuse(status); });
  };
}

void PeerSync::Defer(LockedTask task) {
  HULLD_CHECK(has_peers());
  deferred_.push_back(std::move(task));
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
    on_change_(*id, state_.ApplyPeerChange(locked, *id, changes.by_id.at(*id), since));
    state_.hulls.RestSome(locked);
    state_.bodies.DropSome(locked);
  }
  if (state_.is_cache() && changes.revision > 0) state_.SetTotals(changes.totals);
  if (changes.revision > state_.revision()) state_.feed.NoteOther(locked, changes.revision);
  state_.memory.Evict(locked);
  // Tasks deferred by these tasks wait for the next changes.
  for (const LockedTask& task : std::exchange(deferred_, {})) task(locked);
}

}  // namespace hulld::server
