#include "server/registry/catalog/hull_state.h"

#include "core/base/check.h"

namespace hulld::server {

void HullState::Schedule() {
  HULLD_CHECK(can_schedule());
  work_ = Work::kScheduled;
}

void HullState::StartBuilding() {
  HULLD_CHECK(work_ == Work::kScheduled);
  HULLD_CHECK(life_ == Life::kPresent && !damaged());
  work_ = Work::kBuilding;
}

void HullState::Submit() {
  HULLD_CHECK(work_ == Work::kBuilding);
  HULLD_CHECK(life_ == Life::kPresent && !damaged() && in_flight_ < kMaxInFlight);
  ++in_flight_;
}

void HullState::EndWork() {
  HULLD_CHECK(work_ != Work::kIdle);
  work_ = Work::kIdle;
}

void HullState::StartEnding() {
  HULLD_CHECK(life_ == Life::kPresent && quiet());
  life_ = Life::kEnding;
  in_flight_ = 1;
}

void HullState::Settle(bool is_committed) {
  HULLD_CHECK(in_flight_ > 0);
  --in_flight_;
  switch (life_) {
    case Life::kCreating:
      life_ = is_committed ? Life::kPresent : Life::kGone;
      return;
    case Life::kPresent:
      if (!is_committed && work_ == Work::kBuilding) work_ = Work::kReverting;
      return;
    case Life::kEnding:
      life_ = is_committed ? Life::kGone : Life::kPresent;
      return;
    case Life::kGone:
      break;
  }
  HULLD_UNREACHABLE();  // nothing in flight
}

void HullState::Supersede() {
  HULLD_CHECK(life_ == Life::kPresent && in_flight_ == 0);
  if (work_ == Work::kBuilding) work_ = Work::kReverting;
}

void HullState::Vanish() {
  Supersede();
  life_ = Life::kGone;
}

void HullState::Damage(const absl::Status& damage) {
  HULLD_CHECK(life_ == Life::kPresent && !damaged());
  HULLD_CHECK(!damage.ok());
  damage_ = damage;
}

}  // namespace hulld::server
