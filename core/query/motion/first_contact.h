#ifndef HULLD_CORE_QUERY_MOTION_FIRST_CONTACT_H_
#define HULLD_CORE_QUERY_MOTION_FIRST_CONTACT_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "core/base/boxed.h"
#include "core/query/placed/query_hull.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/separated_interval.h"

namespace hulld {

// A hull in motion, plus a closed ball: a hull by itself, or a piece of a body B in motion. Its
// pose is the product X_WB(t) X_BH, without rounding. The radius of the ball is the exact sum of
// both radii, each finite and at least 0.
struct MovingHull {
  const QueryHull& hull;
  Motion X_WB;
  double radius = 0;
  // The pose of the piece in its body.
  Pose X_BH = {};
  double piece_radius = 0;

  bool is_rounded() const { return radius > 0 || piece_radius > 0; }
};

struct MotionOptions {
  // Maximum width of the bracket of a contact, in (0, 1]. Translations without radii ignore it.
  double max_time_error = 0x1p-30;
  // >= 0, length. If the pair rotates and its minimum separation is within this distance of 0, the
  // relation may be kWithinTolerance. Default: kDefaultRelativeResolution times the sizes of the
  // hulls. Values below kMinRelativeResolution times the size of the pair are raised to that
  // product.
  std::optional<double> resolution;
  // The search may ignore contacts after this time: if the pair is separated up to some later time,
  // the relation may be kSeparated, with separated_until set to such a time.
  double latest = 1;
  bool want_certificate = false;
  // Maximum number of pairs of pieces that a certificate of bodies may list.
  uint64_t max_piece_certificates = std::numeric_limits<uint64_t>::max();
  // Polled in long loops; true ends the search with CANCELLED. May be empty.
  std::function<bool()> should_stop;
};

// Default of MotionOptions::resolution, relative to the sum of the largest absolute coordinates of
// the two hulls and their radii.
inline constexpr double kDefaultRelativeResolution = 1e-9;

// Minimum MotionOptions::resolution, relative to the sum of the largest absolute coordinates of the
// hulls and of their translations. Above the rounding errors of planes, which
// kMotionPlaneErrorFactor bounds. Not tuned.
inline constexpr double kMinRelativeResolution = 0x1p-38;

// Returns OK, or INVALID_ARGUMENT for a max_time_error outside (0, 1], or a resolution that is
// negative or NaN.
absl::Status ValidateMotionOptions(const MotionOptions& options);

// The first contact of a pair in motion. `relation`:
// - kSeparated: the pair is separated at all times.
// - kOverlapping, kTouching: the pair meets. If both motions are translations, kOverlapping if the
//   pair overlaps at some time, otherwise kTouching. For other motions, the relation at
//   contact_time.
// - kWithinTolerance: the minimum separation is within the resolution of 0, and neither contact nor
//   separation is proven.
struct FirstContact {
  Relation relation = Relation::kSeparated;
  // The pair is separated at all times before this, and at this time itself unless it equals
  // contact_time. 1 if kSeparated, unless MotionOptions::latest ended the search.
  double separated_until = 1;
  // If the pair meets: it is in contact at some time in [separated_until, contact_time], and at
  // contact_time itself unless the contact of two translations ends before the next double. The two
  // times are equal or adjacent doubles for translations without radii. Otherwise they are adjacent
  // or at most max_time_error apart. They are farther apart only if the separation at
  // separated_until is below kMinRelativeResolution, where planes prove nothing.
  std::optional<double> contact_time;
  // If requested: consecutive intervals from 0 to separated_until. Empty if separated_until is 0 or
  // a hull is empty.
  std::vector<SeparatedInterval> intervals;
  // If requested and the pair meets: proof of contact at contact_time. The relation at that time is
  // kOverlapping if the certificate has no direction, otherwise kTouching.
  //
  // For translations with a contact that ends before contact_time: no direction, and at most four
  // pairs. The hull of their differences contains 0 at some time between separated_until and
  // contact_time; so 0 is in the hull of the differences at both times, at most eight points.
  Boxed<Certificate> certificate;
};

// Finds the first contact of two hulls in motion. Exact, including grazes, if both motions are
// translations (IsTranslation) and both radii are 0: the time is rational, and no double lies
// strictly inside the bracket. Also exact if both hulls are at rest. Otherwise, no contact is
// missed and none is false; the bracket is as narrow as requested, and the relation is
// kWithinTolerance only within the resolution. Swapping A and B mirrors the answer. Empty hulls are
// separated from everything.
//
// INVALID_ARGUMENT: ValidateMotion, ValidatePose, ValidateMotionOptions; a radius is negative or
// not finite; or, unless the pair meets earlier, no plane can be proven because a rotation nearly
// vanishes (all components of q(t) are below 2^-38 of the largest at the ends) or a size is outside
// [kMotionMinSize, kMotionMaxSize]. CANCELLED: should_stop returned true.
absl::StatusOr<FirstContact> FindFirstContact(const MovingHull& a, const MovingHull& b,
                                              const MotionOptions& options = {});

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_FIRST_CONTACT_H_
