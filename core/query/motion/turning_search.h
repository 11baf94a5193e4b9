#ifndef HULLD_CORE_QUERY_MOTION_TURNING_SEARCH_H_
#define HULLD_CORE_QUERY_MOTION_TURNING_SEARCH_H_

#include <absl/status/statusor.h>

#include <limits>
#include <optional>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/numeric/vector.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_plane.h"
#include "core/query/motion/pair_at.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {

// Finds the first contact of two hulls, at least one of which rotates, by conservative advancement
// (Mirtich 1996). Each step finds the direction in which the hulls are nearest, and a long interval
// over which MovingPlane proves that a plane separates them. The next step starts at the end of
// that interval. If the interval would be shorter than max_time_error, an exact query at a double
// checks for contact.
//
// A plane of constant direction covers most of the gap along it, so a transversal contact needs few
// steps. Near a graze, the nearest direction turns before the gap closes; there, the plane also
// turns, from the direction at one end of the interval to that at the other. Its loss is quadratic
// in the length of the interval, so the number of steps past a graze is proportional to the
// logarithm of its gap.
//
// Before these steps, the search tries to prove separation over the whole motion with a few planes
// between the times at which the hulls seem to be nearest. If the hulls were translating polyhedra,
// with linear gaps along the nearest directions at two times, they would be nearest where both gaps
// are equal. So a miss, however near, needs few planes, and the time of a contact is roughly known.
//
// Near a contact, a step first tries to leap to a time just before the contact, which a parabola
// predicts from the current gap, its rate, and the previous gap. The error of each prediction
// determines how close to the contact the next leap may end. Leaps converge superlinearly, so few
// exact queries are needed. After k consecutive wrong predictions, k steps do not leap.
//
// Once the gap is within the resolution, planes that the hulls may cross by up to the resolution
// decide if the minimum separation over the remaining motion is also within it.
class TurningSearch {
 public:
  // All arguments must outlive the search. Requires: neither hull is empty, and valid motions.
  TurningSearch(const MovingHull& a, const MovingHull& b, const MotionOptions& options);

  // CANCELLED: should_stop returned true. INVALID_ARGUMENT: a rotation nearly vanishes, or sizes
  // are out of range, so that no plane can be proven.
  absl::StatusOr<FirstContact> Run();

 private:
  // A plane that starts at some time.
  struct Plane {
    MovingPlane::Result found;
    Vector end_direction;
  };
  // A plane from separated_ to `until`.
  struct Step {
    double until;
    Vector direction;
    Plane plane;
    // The gap along the direction at separated_.
    double gap;
    // The earliest time at which the plane failed or contact is likely; above 1 if none.
    double failed;
  };

  // The nearest direction at a time, and the gap along it; not positive if none is found.
  struct Ahead {
    double time;
    Vector direction;
    double gap;
  };

  void Take(const Step& step);
  absl::Status ProvePassage();
  std::optional<double> CutOf(const Ahead& from, const Ahead& to);
  absl::StatusOr<Ahead> LookAt(double time);
  absl::StatusOr<Relation> RelationAt(double time) const;
  absl::StatusOr<Vector> DirectionAt(double time);
  absl::StatusOr<Plane> TryPlane(const Vector& n, double start, double end, bool turns,
                                 double margin = 0);
  absl::StatusOr<std::optional<Step>> NextStep();
  bool IsPoor(const Step& step) const;
  double LikelyContact(const Vector& n, double gap);
  absl::StatusOr<std::optional<Step>> LeapTo(double contact, const Vector& n, double gap);
  absl::StatusOr<std::optional<Step>> FindStep(const Vector& n);
  double LatestContactTime() const;
  absl::StatusOr<bool> StaysWithinResolution();
  absl::StatusOr<double> TolerableUntil(bool thorough);
  absl::StatusOr<FirstContact> ConcludeStuck();
  absl::StatusOr<double> FindContactSoon(double latest) const;
  absl::StatusOr<double> FindLateContact(double likely) const;
  absl::StatusOr<double> FindEarlierContact(double contact) const;
  absl::StatusOr<FirstContact> Contact(double time, Relation relation);
  FirstContact WithoutContact(Relation relation);

  const MovingHull& a_;
  const MovingHull& b_;
  const MotionOptions& options_;
  StopPoll poll_;
  MovingPlane plane_;
  RoundedPair rounded_;
  double resolution_;
  // The pair is separated up to this time, inclusive, as intervals_ prove.
  double separated_ = 0;
  std::vector<SeparatedInterval> intervals_;
  // Length of the last step, and the direction at its end; the next ones start from them.
  double last_length_ = 1;
  Vector direction_ = Vector::Zero();
  // True if direction_ is the nearest direction at separated_.
  bool is_nearest_ = false;
  // A time at which floating point found no gap; above 1 if unknown.
  double contact_ = 2;
  // True if the nearest direction turns faster than the gap closes.
  bool turns_ = false;
  double last_gap_ = std::numeric_limits<double>::infinity();
  // Number of consecutive wrong predictions, and number of steps until the next prediction.
  int failed_leaps_ = 0;
  int steps_to_leap_ = 0;
  // The contact time that the last leap predicted, and its distance at that time; 0 after a failed
  // leap.
  double likely_contact_ = 0;
  double leap_length_ = 0;
  // The minimum of the last parabola: the likely least gap.
  double likely_least_gap_ = 0;
  // The vertex pairs of the most recent nearest points, in floating point.
  FloatCombination nearest_pairs_;
  // True if directions are exact except for their rounding: the hulls are too near for floating
  // point.
  bool exact_ = false;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_TURNING_SEARCH_H_
