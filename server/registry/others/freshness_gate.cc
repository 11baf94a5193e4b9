#include "server/registry/others/freshness_gate.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "server/contract/error_info.h"
#include "server/contract/stopped_call.h"
#include "server/process/synchronization.h"

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

Committer::Follower Telling(std::function<void(const absl::Status&)> done) {
  return [done = std::move(done)](Locked& later, const absl::Status& status) {
    later.Afterwards([done, status] { done(status); });
  };
}

}  // namespace

absl::Status FreshnessGate::AwaitOthers(const std::function<bool()>& should_stop) {
  if (!store_.is_shared()) return absl::OkStatus();
  Locked locked(mutex_);
  return AwaitOthers(locked, should_stop);
}

absl::Status FreshnessGate::AwaitOthers(Locked& locked, const std::function<bool()>& should_stop) {
  struct Wait {
    ConditionVariable changed;
    std::optional<absl::Status> status;
  };
  const auto wait = std::make_shared<Wait>();
  committer_.FollowNow(locked, [wait](Locked&, const absl::Status& status) {
    wait->status = status;
    wait->changed.notify_all();
  });
  // Runs the deferred tasks before waiting.
  locked.Unlock();
  locked.Lock();
  const auto is_over = [&] { return wait->status.has_value(); };
  while (!is_over()) {
    locked.WaitOn([&](auto& lock) { wait->changed.wait_for(lock, kStopPoll, is_over); });
    if (Stopped(should_stop)) return Cancelled();
  }
  return *wait->status;
}

std::optional<nanoseconds> FreshnessGate::TryFresh(const Freshness& freshness) {
  if (IsAlwaysFresh(freshness)) return nanoseconds(0);
  Locked locked(mutex_);
  return TryFresh(locked, freshness);
}

std::optional<nanoseconds> FreshnessGate::TryFresh(Locked& locked, const Freshness& freshness) {
  if (catalog_.revision() < freshness.at_least_revision) return std::nullopt;
  if (!store_.is_shared()) return nanoseconds(0);
  const std::optional<SteadyClock::time_point> caught_up = committer_.caught_up(locked);
  if (!caught_up.has_value()) return std::nullopt;
  const SteadyClock::time_point began =
      freshness.began.has_value() ? *freshness.began : SteadyClock::now();
  const nanoseconds staleness = std::max<nanoseconds>(began - *caught_up, nanoseconds(0));
  if (!freshness.max_staleness.has_value()) return staleness;
  if (staleness > *freshness.max_staleness) return std::nullopt;
  if (staleness > *freshness.max_staleness / 2) AskAhead(locked);
  return staleness;
}

void FreshnessGate::AskAhead(Locked& locked) {
  if (std::exchange(is_asking_ahead_, true)) return;
  committer_.Follow(locked, [this](Locked&, const absl::Status&) { is_asking_ahead_ = false; });
}

absl::StatusOr<nanoseconds> FreshnessGate::AwaitFresh(const Freshness& freshness,
                                                      const std::function<bool()>& should_stop) {
  if (IsAlwaysFresh(freshness)) return nanoseconds(0);
  Locked locked(mutex_);
  return AwaitFresh(locked, freshness, should_stop);
}

absl::StatusOr<nanoseconds> FreshnessGate::AwaitFresh(Locked& locked, const Freshness& freshness,
                                                      const std::function<bool()>& should_stop) {
  if (const auto staleness = TryFresh(locked, freshness)) return *staleness;
  if (store_.is_shared()) {
    if (absl::Status s = AwaitOthers(locked, should_stop); !s.ok()) return s;
  }
  if (catalog_.revision() >= freshness.at_least_revision) return nanoseconds(0);
  return FutureRevision(freshness.at_least_revision, catalog_.revision());
}

bool FreshnessGate::StartFresh(const Freshness& freshness,
                               std::function<void(const absl::Status&)> done) {
  Locked locked(mutex_);
  if (!store_.is_shared() || TryFresh(locked, freshness).has_value()) return false;
  committer_.FollowNow(locked, Telling(std::move(done)));
  return true;
}

void FreshnessGate::WhenFresh(Refusal refuse, LockedTask next) {
  Locked locked(mutex_);
  if (!store_.is_shared()) return next(locked);
  committer_.Follow(locked, [refuse = std::move(refuse), next = std::move(next)](
                                Locked& later, const absl::Status& status) {
    if (status.ok()) return next(later);
    later.Afterwards([refuse, status] { refuse(status); });
  });
}

}  // namespace hulld::server
