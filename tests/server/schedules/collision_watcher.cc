#include "tests/server/schedules/collision_watcher.h"

#include <absl/strings/str_cat.h>

#include "server/registry/catalog/body.h"

namespace hulld::server {
namespace {

std::string Text(const std::pair<uint64_t, uint64_t>& version) {
  return absl::StrCat("revision ", version.second, " of the incarnation of ", version.first);
}

}  // namespace

void CollisionWatcher::Run() {
  Scheduler::Current().Note("opens a collision watch");
  // The other hull is watched only as a piece, or also by itself.
  ids_ = {HullName(0)};
  if (Scheduler::Current().random().OneIn(2)) ids_.push_back(HullName(1));
  views_.resize(ids_.size());
  const auto on_ready = [self = shared_from_this()] {
    self->is_ready_ = true;
    Scheduler::Current().Notify(&self->is_ready_);
  };
  bool lasts = Receive(hulls_.Open(ids_, on_ready, {}, {}));
  has_begun_ = true;
  Scheduler::Current().Notify(this);
  while (lasts && !is_ending_) {
    absl::StatusOr<WatchedHulls::Round> round = hulls_.TakeChanges({});
    const bool waits = round.ok() && round->waits;
    lasts = Receive(std::move(round));
    if (!lasts || is_ending_ || !waits) continue;
    const auto is_ready = [](const void* ready) { return *static_cast<const bool*>(ready); };
    Scheduler::Current().WaitUntil(&is_ready_, {is_ready, &is_ready_});
    is_ready_ = false;
  }
  is_over_ = true;
  Scheduler::Current().Notify(this);
  // Breaks the cycle of on_ready.
  hulls_.Close();
  views_.clear();
}

bool CollisionWatcher::MayFail(const absl::Status& status) const {
  const Plan& plan = simulation_.plan;
  switch (status.code()) {
    case absl::StatusCode::kNotFound:
      return true;
    case absl::StatusCode::kUnavailable:
      return simulation_.store.failed() > 0;
    case absl::StatusCode::kResourceExhausted:
      return simulation_.store.was_full() || !plan.has_memory || plan.pressure > 0;
    case absl::StatusCode::kDataLoss:
      return simulation_.store.has_damage();
    default:
      return false;
  }
}

bool CollisionWatcher::Receive(absl::StatusOr<WatchedHulls::Round> round) {
  if (!round.ok()) {
    if (!MayFail(round.status())) Scheduler::Current().Fail(round.status().ToString());
    return false;
  }
  for (size_t n = 0; n < round->places.size(); ++n) {
    absl::StatusOr<HullView>& view = views_[round->places[n]];
    view = std::move(round->resolved.hulls[n]);
    if (!view.ok() && !MayFail(view.status())) Scheduler::Current().Fail(view.status().ToString());
    if (!view.ok()) continue;
    sent_[view->record.hull_id] = {view->record.create_revision, view->record.revision};
    ++simulation_.reached.resolved;
  }
  for (const HullRecord& hull : round->piece_hulls) {
    sent_[hull.hull_id] = {hull.create_revision, hull.revision};
    ++simulation_.reached.pieces_sent;
  }
  for (const absl::StatusOr<HullView>& view : views_) {
    if (!view.ok()) continue;
    CheckSent(view->record);
    if (view->body == nullptr) continue;
    for (const HullView& piece : view->body->hulls) CheckSent(piece.record);
  }
  if (IsCurrent()) Scheduler::Current().Notify(this);
  return true;
}

void CollisionWatcher::CheckSent(const HullRecord& hull) const {
  const auto sent = sent_.find(hull.hull_id);
  const Version used = {hull.create_revision, hull.revision};
  if (sent != sent_.end() && sent->second == used) return;
  Scheduler::Current().Fail(absl::StrCat("a collision watch uses \"", hull.hull_id, "\" at ",
                                         Text(used), ", but its client received ",
                                         sent == sent_.end() ? "no version" : Text(sent->second)));
}

bool CollisionWatcher::IsCurrent(size_t hull, const absl::StatusOr<HullView>& view) const {
  const Ledger::State& last = simulation_.ledger().Last(hull);
  if (!last.exists && !last.is_body) return !view.ok();
  if (!view.ok()) return !absl::IsNotFound(view.status()) || last.is_body;
  if (view->record.revision != last.record.revision) return false;
  if (view->body == nullptr) return last.exists;
  for (const HullView& piece : view->body->hulls) {
    const auto other = static_cast<size_t>(piece.record.hull_id[0] - 'a');
    const Ledger::State& of_piece = simulation_.ledger().Last(other);
    if (!of_piece.exists || piece.record.revision != of_piece.record.revision) return false;
  }
  return last.is_body;
}

bool CollisionWatcher::IsCurrent() const {
  for (size_t place = 0; place < views_.size(); ++place) {
    if (!IsCurrent(place, views_[place])) return false;
  }
  return true;
}

void CollisionWatcher::End() {
  const auto may_end = [](const void* self) {
    const auto& watcher = *static_cast<const CollisionWatcher*>(self);
    return watcher.has_begun_ && (watcher.is_over_ || watcher.IsCurrent());
  };
  Scheduler::Current().WaitUntil(this, {may_end, this});
  is_ending_ = true;
  is_ready_ = true;
  Scheduler::Current().Notify(&is_ready_);
}

}  // namespace hulld::server
