#include "server/registry/catalog/preparer.h"

#include "core/base/check.h"
#include "core/query/placed/live_hull.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

bool Preparer::IsWanted(const RegisteredHull& hull, uint64_t expected_questions) {
  return !hull.is_preparing() && hull.live() != nullptr && hull.state.visible() &&
         hull.live()->WantsPreparing(hull.committed_mark(), expected_questions);
}

void Preparer::Prepare(Locked& locked, RegisteredHull& hull) {
  HULLD_CHECK(!hull.is_preparing() && hull.live() != nullptr);
  hull.SetPreparing(true);
  hull.ResetWear();
  const std::shared_ptr<LiveHull> live = hull.live();
  const LiveHull::Mark mark = hull.committed_mark();
  locked.Unlock();
  live->Prepare(mark);
  locked.Lock();
  hull.SetPreparing(false);
  if (hull.live() != live) return;
  hull.NotePrepared(locked);
  catalog_.NoteChange(hull);
}

void Preparer::Schedule(const HullPointer& hull) {
  HULLD_CHECK(!hull->is_preparing());
  hull->SetPreparing(true);
  thread_->Submit([this, hull] {
    Locked locked(mutex_);
    hull->SetPreparing(false);
    if (is_stopped_ || hull->live() == nullptr) return;
    Prepare(locked, *hull);
    memory_.Evict(locked);
  });
}

void Preparer::Stop(const Locked& locked) {
  HULLD_CHECK(locked.Holds(mutex_));
  is_stopped_ = true;
}

void Preparer::ScheduleIfWorn(const HullPointer& hull) {
  if (!is_stopped_ && hull->IsWorn() && !hull->is_preparing()) Schedule(hull);
}

}  // namespace hulld::server
