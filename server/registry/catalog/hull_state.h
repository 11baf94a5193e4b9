#ifndef HULLD_SERVER_REGISTRY_CATALOG_HULL_STATE_H_
#define HULLD_SERVER_REGISTRY_CATALOG_HULL_STATE_H_

#include <absl/status/status.h>

namespace hulld::server {

// The state of one hull in the registry, and the only steps from one state to another. Each step
// checks that it is legal; an illegal one ends the process. Not thread-safe.
//
// A state has two named parts. The life of the hull:
//
//   kCreating --Commit--> kPresent --StartEnding--> kEnding --Commit--> kGone
//       \                     ^_________Refuse__________/                 ^
//        \___________________________Refuse_______________________________/
//
// and the work on its builder, which one thread owns at a time:
//
//   kIdle --Schedule--> kScheduled --StartBuilding--> kBuilding --Refuse--> kReverting
//   kScheduled, kBuilding, kReverting --EndWork--> kIdle
//
// Where other servers change hulls, too, Supersede takes a hull that is present to another version,
// and Vanish makes it gone; what a thread builds on it then is reverted.
//
// Beside them it counts the changes in flight (submitted to the store, neither committed nor
// refused), and knows whether the hull is damaged. Readers take no part: they never touch the
// builder, and find what is committed at any moment. Steps are legal only where these agree:
//
//   - Only a hull that is present and not damaged grows. A creation and an end are one change in
//     flight; only chunks overlap, kMaxInFlight of them at most.
//   - A hull ends here only when it is quiet: idle, with nothing in flight. What others do to it
//     finds nothing in flight, but maybe a thread at work.
class HullState {
 public:
  enum class Life {
    // The creation is in flight: readers do not see the hull yet.
    kCreating,
    kPresent,
    // A deletion or a replacement is in flight: readers still see the hull.
    kEnding,
    // It is found no more; open sessions and readers may still hold it.
    kGone,
  };
  enum class Work {
    kIdle,
    // The next chunk waits for a thread. The builder is in its place.
    kScheduled,
    // A chunk is being built: its thread owns the builder.
    kBuilding,
    // A chunk is being built on one that was refused since: the result must be dropped.
    kReverting,
  };

  // Enough chunks of one hull to keep a builder busy through the slowest sync.
  static constexpr int kMaxInFlight = 64;

  // The state of a hull that is committed.
  static HullState Present() { return HullState(Life::kPresent, 0); }
  // The state of a hull whose creation, or replacement of another, is submitted.
  static HullState Creating() { return HullState(Life::kCreating, 1); }

  Life life() const { return life_; }
  Work work() const { return work_; }
  int in_flight() const { return in_flight_; }
  // OK unless the store cannot give the hull back.
  const absl::Status& damage() const { return damage_; }

  bool visible() const { return life_ == Life::kPresent || life_ == Life::kEnding; }
  bool gone() const { return life_ == Life::kGone; }
  // Whether the hull is about to begin or to end: whatever depends on which has to wait.
  bool changing_life() const { return life_ == Life::kCreating || life_ == Life::kEnding; }
  bool damaged() const { return !damage_.ok(); }
  bool quiet() const { return work_ == Work::kIdle && in_flight_ == 0; }
  // Whether Schedule is legal.
  bool can_schedule() const {
    return life_ == Life::kPresent && work_ == Work::kIdle && !damaged() &&
           in_flight_ < kMaxInFlight;
  }

  // A thread is asked to build the next chunk.
  void Schedule();
  // It has begun: the builder is its own.
  void StartBuilding();
  // The chunk that is being built is submitted.
  void Submit();
  // The thread that was scheduled or built has put the builder back, if it had it. Returns false
  // after kReverting: the builder holds points that were refused.
  bool EndWork();

  // A deletion or a replacement is submitted.
  void StartEnding();
  // The oldest change in flight is committed, or refused.
  void Commit();
  void Refuse();

  // Another server changed the hull, or ended it. Requires that it is present, and that nothing is
  // in flight.
  void Supersede();
  void Vanish();

  // The store cannot give back what it holds of the hull. damage: not OK.
  void Damage(const absl::Status& damage);

 private:
  HullState(Life life, int in_flight) : life_(life), in_flight_(in_flight) {}

  Life life_;
  Work work_ = Work::kIdle;
  int in_flight_;
  absl::Status damage_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_HULL_STATE_H_
