#ifndef HULLD_CORE_QUERY_MOTION_TURNING_SEARCH_H_
#define HULLD_CORE_QUERY_MOTION_TURNING_SEARCH_H_

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/numeric/vector.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_plane.h"
#include "core/query/terms/relation.h"

namespace hulld {

// Finds the first contact of two hulls of which at least one turns, by conservative advancement
// (Mirtich 1996). At a time that is known to be separated, the direction in which the hulls are
// nearest gives a plane, and the longest interval found for which MovingPlane proves it leads to
// the next time. If the plane fails within max_time_error, an exact query at a double may prove
// contact. Each step takes most of the gap along its direction, so a transversal contact needs few
// steps, and a graze a number proportional to the logarithm of the resolution.
//
// Once the gap is within the resolution, planes that the hulls may cross by the resolution decide
// if the least separation of the remaining motion is within it, too.
class TurningSearch {
 public:
  // All arguments must outlive the search. Requires: neither hull is empty, valid motions.
  TurningSearch(const MovingHull& a, const MovingHull& b, const MotionOptions& options);

  // CANCELLED: should_stop returned true. INVALID_ARGUMENT: a rotation nearly vanishes, or sizes
  // are out of range, so that no plane can be proven.
  absl::StatusOr<FirstContact> Run();

 private:
  // A plane from separated_ to `until`.
  struct Step {
    double until;
    double offset;
    // The gaps along the direction at both ends.
    double gap_before;
    double gap_after;
    // The earliest time at which the plane failed; above 1 if none.
    double failed;
  };

  absl::StatusOr<Relation> RelationAt(double time) const;
  absl::StatusOr<bool> IsWithinResolution() const;
  absl::StatusOr<Vector> DirectionAt(double time) const;
  std::optional<Step> FindStep(const Vector& n) const;
  double LatestContactTime() const;
  absl::StatusOr<double> TolerableUntil(Vector n);
  absl::StatusOr<FirstContact> ConcludeStuck();
  absl::StatusOr<double> FindLateContact(double likely) const;
  absl::StatusOr<FirstContact> Contact(double time);
  FirstContact WithoutContact(Relation relation);

  const MovingHull& a_;
  const MovingHull& b_;
  const MotionOptions& options_;
  StopPoll poll_;
  MovingPlane plane_;
  double resolution_;
  // The pair is separated up to this time, inclusive, as intervals_ prove.
  double separated_ = 0;
  std::vector<SeparatedInterval> intervals_;
  // Length and direction of the last step; the next ones start from them.
  double last_length_ = 1;
  Vector last_direction_ = Vector::Zero();
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_TURNING_SEARCH_H_
