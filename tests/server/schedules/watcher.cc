#include "tests/server/schedules/watcher.h"

#include <absl/strings/str_cat.h>

#include <utility>

namespace hulld::server {
namespace {

using State = Ledger::State;

}  // namespace

void Watcher::Run() {
  Scheduler::Current().Note("opens a watch");
  ChangeFeed& feed = simulation_.registry.feed();
  auto watch = feed.Open({}, {}, [self = shared_from_this()] {
    self->is_ready_ = true;
    Scheduler::Current().Notify(&self->is_ready_);
  });
  is_refused_ = !watch.ok();
  if (is_refused_ && !absl::IsResourceExhausted(watch.status())) {
    Scheduler::Current().Fail(watch.status().ToString());
  }
  if (!is_refused_) watch_ = *watch;
  has_begun_ = true;
  Scheduler::Current().Notify(this);
  if (is_refused_) return;
  while (!is_ending_) {
    const absl::StatusOr<WatchBatch> batch = feed.Next(watch_);
    // The existing hulls could not be read; the next call reads again.
    if (absl::IsUnavailable(batch.status()) && simulation_.store.failed() > 0) continue;
    if (!batch.ok()) Scheduler::Current().Fail(batch.status().ToString());
    if (batch->restarted) reported_ = {};
    for (const HullChange& change : batch->changes) Receive(change);
    revision_ = batch->revision;
    if (IsCurrent()) Scheduler::Current().Notify(this);
    if (!batch->waits) continue;
    const auto is_ready = [](const void* ready) { return *static_cast<const bool*>(ready); };
    Scheduler::Current().WaitUntil(&is_ready_, {is_ready, &is_ready_});
    is_ready_ = false;
  }
  feed.Close(watch_);
  // Breaks the cycle of on_ready.
  watch_ = nullptr;
}

void Watcher::Receive(const HullChange& change) {
  const Ledger& ledger = simulation_.ledger();
  const auto hull = static_cast<size_t>(change.record.hull_id[0] - 'a');
  const bool is_there = change.kind != ChangeKind::kDeleted;
  const auto is_it = [&](const State& state) {
    if (state.exists != is_there) return false;
    return is_there ? state.record == change.record : state.revision == change.record.revision;
  };
  Ledger::Moment since;
  since.states[hull] = reported_[hull];
  const auto state = ledger.Find(hull, since, is_it);
  if (!state.has_value()) {
    Scheduler::Current().Fail(absl::StrCat("a watch at state ", reported_[hull], " reports ",
                                           is_there ? "a hull" : "a deletion", " at revision ",
                                           change.record.revision, "; ", ledger.Describe(hull)));
  }
  if (!MayBeOfKind(hull, change, *state)) {
    Scheduler::Current().Fail(absl::StrCat("a watch at state ", reported_[hull], " reports kind ",
                                           static_cast<int>(change.kind), " at revision ",
                                           change.record.revision, "; ", ledger.Describe(hull)));
  }
  reported_[hull] = *state;
  ++simulation_.reached.reported;
}

// Checks the rules of HullEventKind. state: the reported state.
bool Watcher::MayBeOfKind(size_t hull, const HullChange& change, size_t state) const {
  const Ledger& ledger = simulation_.ledger();
  const uint64_t incarnation = change.record.create_revision;
  size_t first = reported_[hull];
  // A hull that was created and deleted since is not reported.
  while (first + 1 < state && ledger.At(hull, first + 1).revision <= revision_) ++first;
  const State& before = ledger.At(hull, first);
  bool another_was_there = false;
  for (size_t i = first; i < state; ++i) {
    const State& between = ledger.At(hull, i);
    another_was_there |= between.exists && between.record.create_revision != incarnation;
  }
  switch (change.kind) {
    case ChangeKind::kCreated:
      return !before.exists && !another_was_there;
    case ChangeKind::kChanged:
      return before.exists && before.record.create_revision == incarnation;
    case ChangeKind::kReplaced:
      return another_was_there;
    case ChangeKind::kPresent:
    case ChangeKind::kDeleted:
      return true;
  }
  return false;
}

// Chunks without new vertices are not reported.
bool Watcher::IsCurrent() const {
  for (size_t hull = 0; hull < kHulls; ++hull) {
    const Ledger& ledger = simulation_.ledger();
    const State& last = ledger.Last(hull);
    const State& reported = ledger.At(hull, reported_[hull]);
    if (reported.exists != last.exists || (last.exists && reported.revision != last.revision))
      return false;
  }
  return true;
}

void Watcher::End() {
  const auto may_end = [](const void* self) {
    const auto& watcher = *static_cast<const Watcher*>(self);
    return watcher.has_begun_ && (watcher.is_refused_ || watcher.IsCurrent());
  };
  Scheduler::Current().WaitUntil(this, {may_end, this});
  const std::shared_ptr<Watch> watch = watch_;
  is_ending_ = true;
  if (watch != nullptr) simulation_.registry.feed().Nudge(watch);
}

}  // namespace hulld::server
