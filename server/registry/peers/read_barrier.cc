#include "server/registry/peers/read_barrier.h"

#include <absl/strings/str_cat.h>

#include <memory>

#include "core/base/check.h"
#include "core/base/status_macros.h"
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

}  // namespace

absl::Status ReadBarrier::AwaitCommits(Locked& locked, const std::function<bool()>& should_stop) {
  struct Wait {
    ConditionVariable changed;
    std::optional<absl::Status> status;
  };
  const auto wait = std::make_shared<Wait>();
  committer_.StartBarrier(locked, [wait](Locked&, const absl::Status& status) {
    wait->status = status;
    wait->changed.notify_all();
  });
  // Runs the deferred tasks before waiting.
  locked.Yield();
  const auto is_over = [&] { return wait->status.has_value(); };
  while (!is_over()) {
    locked.WaitOn([&](auto& lock) { wait->changed.wait_for(lock, kStopPoll, is_over); });
    if (Stopped(should_stop)) return Cancelled();
  }
  return *wait->status;
}

absl::Status ReadBarrier::AwaitPeers(const std::function<bool()>& should_stop) {
  if (!has_peers()) return absl::OkStatus();
  Locked locked(state_.mutex);
  return AwaitPeers(locked, should_stop);
}

std::optional<nanoseconds> ReadBarrier::TryFresh(const Freshness& freshness) {
  if (!has_peers() && freshness.at_least_revision == 0) return nanoseconds(0);
  Locked locked(state_.mutex);
  return TryFresh(locked, freshness);
}

std::optional<nanoseconds> ReadBarrier::TryFresh(Locked& /*locked*/, const Freshness& freshness) {
  if (state_.revision() < freshness.at_least_revision) return std::nullopt;
  return nanoseconds(0);
}

absl::StatusOr<nanoseconds> ReadBarrier::AwaitFresh(const Freshness& freshness,
                                                    const std::function<bool()>& should_stop) {
  if (!has_peers() && freshness.at_least_revision == 0) return nanoseconds(0);
  Locked locked(state_.mutex);
  return AwaitFresh(locked, freshness, should_stop);
}

absl::StatusOr<nanoseconds> ReadBarrier::AwaitFresh(Locked& locked, const Freshness& freshness,
                                                    const std::function<bool()>& should_stop) {
  if (const auto staleness = TryFresh(locked, freshness)) return *staleness;
  HULLD_RETURN_IF_ERROR(AwaitPeers(locked, should_stop));
  const uint64_t revision = state_.revision();
  if (revision >= freshness.at_least_revision) return nanoseconds(0);
  return FutureRevision(freshness.at_least_revision, revision);
}

void ReadBarrier::WhenFresh(Refusal /*refuse*/, LockedTask next) {
  Locked locked(state_.mutex);
  next(locked);
}

void ReadBarrier::Defer(LockedTask /*task*/) { HULLD_CHECK(has_peers()); }

}  // namespace hulld::server
