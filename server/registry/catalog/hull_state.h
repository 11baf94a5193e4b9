#ifndef HULLD_SERVER_REGISTRY_CATALOG_HULL_STATE_H_
#define HULLD_SERVER_REGISTRY_CATALOG_HULL_STATE_H_

#include <absl/status/status.h>

#include "core/base/check.h"

namespace hulld::server {

// State machine of a hull in the registry. Each transition checks that it is legal; an illegal
// one aborts the process. Not thread-safe.
//
// A state has two named parts. The life of the hull:
//
//   kCreating --Commit--> kPresent --StartEnding--> kEnding --Commit--> kGone
//       \                     ^_________Refuse__________/                 ^
//        \___________________________Refuse_______________________________/
//
// and the work on its builder, which one thread owns exclusively:
//
//   kIdle --Schedule--> kScheduled --StartBuilding--> kBuilding --Refuse--> kReverting
//   kScheduled, kBuilding, kReverting --EndWork--> kIdle
//
// Changes committed by peer servers: Supersede moves a present hull to another version, and Vanish
// moves it to kGone; work in progress on its builder is then reverted.
//
// The state also counts the changes in flight (submitted to the store, but neither committed nor
// refused), and records damage. Readers never touch the builder, and always see the committed
// state. Further conditions on transitions:
//
//   - Only a present, undamaged hull grows. A creation or an end is a single change in flight; only
//     chunks overlap, at most kMaxInFlight of them.
//   - A local change ends a hull only when it is quiet: idle, with nothing in flight. A peer change
//     requires that nothing is in flight, but a thread may be at work.
class HullState {
 public:
  enum class Life {
    // The creation is in flight; readers do not see the hull yet.
    kCreating,
    kPresent,
    // A deletion or a replacement is in flight; readers still see the hull.
    kEnding,
    // Lookups no longer find the hull; open sessions and readers may still reference it.
    kGone,
  };
  enum class Work {
    kIdle,
    // The next chunk waits for a thread. No thread owns the builder.
    kScheduled,
    // A chunk is being built; its thread owns the builder.
    kBuilding,
    // A chunk is being built on a state that has been reverted since; its result must be dropped.
    kReverting,
  };

  // Maximum number of chunks of a hull in flight: enough to keep a builder busy during the slowest
  // sync.
  static constexpr int kMaxInFlight = 64;

  // State of a committed hull.
  static HullState Present() { return HullState(Life::kPresent, 0); }
  // State of a hull after its creation, or its replacement of another hull, is submitted.
  static HullState Creating() { return HullState(Life::kCreating, 1); }

  Life life() const { return life_; }
  Work work() const { return work_; }
  int in_flight() const { return in_flight_; }
  // OK unless the store cannot read the hull back.
  const absl::Status& damage() const { return damage_; }

  bool visible() const { return life_ == Life::kPresent || life_ == Life::kEnding; }
  bool gone() const { return life_ == Life::kGone; }
  // True if a creation or an end is in flight; dependent calls must wait.
  bool changing_life() const { return life_ == Life::kCreating || life_ == Life::kEnding; }
  bool damaged() const { return !damage_.ok(); }
  bool quiet() const { return work_ == Work::kIdle && in_flight_ == 0; }
  // True if Schedule is legal.
  bool can_schedule() const {
    return life_ == Life::kPresent && work_ == Work::kIdle && !damaged() &&
           in_flight_ < kMaxInFlight;
  }

  // Requests a thread for the next chunk.
  void Schedule() {
    HULLD_CHECK(can_schedule());
    work_ = Work::kScheduled;
  }
  // Transfers the builder to the scheduled thread.
  void StartBuilding() {
    HULLD_CHECK(work_ == Work::kScheduled);
    HULLD_CHECK(life_ == Life::kPresent && !damaged());
    work_ = Work::kBuilding;
  }
  // Counts the chunk being built as in flight.
  void Submit() {
    HULLD_CHECK(work_ == Work::kBuilding);
    HULLD_CHECK(life_ == Life::kPresent && !damaged() && in_flight_ < kMaxInFlight);
    ++in_flight_;
  }
  // Ends the work of the scheduled or building thread, which has returned the builder if it owned
  // it.
  void EndWork() {
    HULLD_CHECK(work_ != Work::kIdle);
    work_ = Work::kIdle;
  }

  // Submits a deletion or a replacement.
  void StartEnding() {
    HULLD_CHECK(life_ == Life::kPresent && quiet());
    life_ = Life::kEnding;
    in_flight_ = 1;
  }
  // Commits or refuses the oldest change in flight.
  void Commit() { Settle(true); }
  void Refuse() { Settle(false); }

  // A peer server changed or ended the hull. Requires: the hull is present, with nothing in flight.
  void Supersede() {
    HULLD_CHECK(life_ == Life::kPresent && in_flight_ == 0);
    if (work_ == Work::kBuilding) work_ = Work::kReverting;
  }
  void Vanish() {
    Supersede();
    life_ = Life::kGone;
  }

  // Records that the store cannot read the hull back. Requires: `damage` is not OK.
  void Damage(const absl::Status& damage) {
    HULLD_CHECK(life_ == Life::kPresent && !damaged());
    HULLD_CHECK(!damage.ok());
    damage_ = damage;
  }

 private:
  HullState(Life life, int in_flight) : life_(life), in_flight_(in_flight) {}
  void Settle(bool is_committed) {
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

  Life life_;
  Work work_ = Work::kIdle;
  int in_flight_;
  absl::Status damage_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_HULL_STATE_H_
