#include "tests/server/schedules/watcher.h"

#include <absl/strings/str_cat.h>

#include <utility>

namespace hulld::server {
namespace {

using State = Ledger::State;

// Blocks until `object` changes so that the condition holds.
void WaitFor(const void* object, bool (*holds)(const void*), const void* context,
             const std::source_location& where = std::source_location::current()) {
  while (!holds(context)) {
    Scheduler::Current().Wait(object, Scheduler::kNoDeadline, {holds, context}, where);
  }
}

void Tell(const void* object) {
  Scheduler::Current().Notify(object, true, std::source_location::current());
}

}  // namespace

void Watcher::Run() {
  Registry& registry = simulation_.registry;
  Scheduler::Current().Note("opens a watch");
  auto watch = registry.OpenWatch({}, {.tell_present = true}, [self = shared_from_this()] {
    self->is_ready_ = true;
    Tell(&self->is_ready_);
  });
  is_refused_ = !watch.ok();
  if (is_refused_ && !absl::IsResourceExhausted(watch.status())) {
    Scheduler::Current().Fail(watch.status().ToString());
  }
  if (!is_refused_) watch_ = *watch;
  has_begun_ = true;
  Tell(this);
  if (is_refused_) return;
  while (!is_ending_) {
    const absl::StatusOr<WatchPiece> piece = registry.TakeChanges(*watch_);
    // The store cannot be read at the moment; retry.
    if (absl::IsUnavailable(piece.status()) && simulation_.store.failed() > 0) continue;
    if (!piece.ok()) Scheduler::Current().Fail(piece.status().ToString());
    if (piece->anew) told_ = {};
    for (const HullChange& change : piece->changes) Take(change);
    revision_ = piece->revision;
    if (KnowsAll()) Tell(this);
    if (piece->waits) WaitUntilReady();
  }
  registry.CloseWatch(watch_);
  // The watch holds a reference to this.
  watch_ = nullptr;
}

void Watcher::WaitUntilReady() {
  WaitFor(
      &is_ready_, [](const void* ready) { return *static_cast<const bool*>(ready); }, &is_ready_);
  is_ready_ = false;
}

void Watcher::Take(const HullChange& change) {
  const Ledger& ledger = simulation_.ledger();
  const auto hull = static_cast<size_t>(change.record.hull_id[0] - 'a');
  const bool is_there = change.kind != ChangeKind::kDeleted;
  const auto is_it = [&](const State& state) {
    if (state.exists != is_there) return false;
    return is_there ? state.record == change.record : state.revision == change.record.revision;
  };
  Ledger::Moment since;
  since.states[hull] = told_[hull];
  const auto state = ledger.Find(hull, since, is_it);
  if (!state.has_value()) {
    Scheduler::Current().Fail(absl::StrCat("a watch that was told of state ", told_[hull],
                                           " is told of ", is_there ? "a hull" : "an end",
                                           " at revision ", change.record.revision, "; ",
                                           ledger.Describe(hull)));
  }
  if (!MayBeOfKind(hull, change, *state)) {
    Scheduler::Current().Fail(absl::StrCat("a watch that was told of state ", told_[hull],
                                           " is told of kind ", static_cast<int>(change.kind),
                                           " at revision ", change.record.revision, "; ",
                                           ledger.Describe(hull)));
  }
  told_[hull] = *state;
  ++simulation_.reached.told;
}

// Returns true if the event's kind, as HullEventKind defines it, fits the received state.
bool Watcher::MayBeOfKind(size_t hull, const HullChange& change, size_t state) const {
  const Ledger& ledger = simulation_.ledger();
  const uint64_t incarnation = change.record.create_revision;
  size_t first = told_[hull];
  // A hull that was created and deleted in between is not reported.
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

// Chunks without a new vertex are not reported.
bool Watcher::KnowsAll() const {
  for (size_t hull = 0; hull < kHulls; ++hull) {
    const Ledger& ledger = simulation_.ledger();
    const State& last = ledger.Last(hull);
    const State& told = ledger.At(hull, told_[hull]);
    if (told.exists != last.exists || (last.exists && told.revision != last.revision)) return false;
  }
  return true;
}

void Watcher::End() {
  WaitFor(
      this,
      [](const void* self) {
        const auto& watcher = *static_cast<const Watcher*>(self);
        return watcher.has_begun_ && (watcher.is_refused_ || watcher.KnowsAll());
      },
      this);
  const std::shared_ptr<ChangeWatch> watch = watch_;
  is_ending_ = true;
  if (watch != nullptr) simulation_.registry.NudgeWatch(watch);
}

}  // namespace hulld::server
