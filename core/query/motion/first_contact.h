#ifndef HULLD_CORE_QUERY_MOTION_FIRST_CONTACT_H_
#define HULLD_CORE_QUERY_MOTION_FIRST_CONTACT_H_

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "core/base/boxed.h"
#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/placed/query_hull.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/relation.h"

namespace hulld {

// A hull in motion, plus a closed ball of the radius: finite and at least 0.
struct MovingHull {
  const QueryHull& hull;
  Motion X_WH;
  double radius = 0;
};

struct MotionOptions {
  // The largest width of the bracket of a contact, in (0, 1]. Translations without radii ignore it.
  double max_time_error = 0x1p-30;
  // >= 0, length. If the pair rotates and its least separation is within this of 0, the relation
  // may be kWithinTolerance. Absent: kDefaultRelativeResolution times the sizes of the hulls. Less
  // than kLeastRelativeResolution times the size of the pair counts as that.
  std::optional<double> resolution;
  bool want_certificate = false;
  // Polled in long loops; true ends the search with CANCELLED. May be empty.
  std::function<bool()> should_stop;
};

// Default of MotionOptions::resolution, relative to the largest absolute coordinates of the two
// hulls and their radii, added.
inline constexpr double kDefaultRelativeResolution = 1e-9;

// The least MotionOptions::resolution, relative to the largest absolute coordinates of the hulls
// and of their translations, added. Above the rounding of planes, which kMotionPlaneErrorFactor
// bounds. A choice.
inline constexpr double kLeastRelativeResolution = 0x1p-38;

// Returns OK, or INVALID_ARGUMENT for a max_time_error outside (0, 1], or a resolution that is
// negative or NaN.
absl::Status ValidateMotionOptions(const MotionOptions& options);

// Proof that a pair is separated from the end of the previous interval, or 0, up to `until`. The
// direction n (world frame, from A toward B, not zero, of any length) and the offset are exact as
// given.
//
// With an offset: n.p < offset - radius_A |n| for all points p of A, and n.p > offset + radius_B
// |n| for all p of B. For a vertex v, |q(t)|^2 (n.p(t) - offset) is a cubic polynomial in t, and
// its Bernstein coefficients over the interval all have this sign.
// Without an offset, for translations: n.(b(t) - a(t)) > (radius_A + radius_B) |n| for all vertices
// a and b at both ends, where equality is allowed at `until` of the last interval before a contact.
struct SeparatedInterval {
  double until = 1;
  std::variant<Vector, IntegerVector> direction;
  std::optional<double> offset;
};

// The first contact of a pair in motion. `relation`:
// - kSeparated: the pair is separated at all times.
// - kOverlapping, kTouching: the pair meets. If both motions are translations, kOverlapping if it
//   overlaps at some time, otherwise kTouching. For other motions, the relation at contact_time.
// - kWithinTolerance: the least separation is within the resolution of 0, and neither contact nor
//   separation is proven.
struct FirstContact {
  Relation relation = Relation::kSeparated;
  // The pair is separated at all times before this; and at this time, unless it equals
  // contact_time. 1 if kSeparated.
  double separated_until = 1;
  // If the pair meets: it is in contact at some time of [separated_until, contact_time], and at
  // contact_time itself unless the contact of two translations ends before the next double. The
  // two times are equal or adjacent doubles for translations without radii. Otherwise they are
  // adjacent or at most max_time_error apart, and farther only if the separation is below
  // kLeastRelativeResolution for that long before the contact.
  std::optional<double> contact_time;
  // If requested: consecutive intervals from 0 to separated_until, none if that is 0. Empty if a
  // hull is empty.
  std::vector<SeparatedInterval> intervals;
  // If requested and the pair meets: proof of contact at contact_time. The relation at that time is
  // kOverlapping if the certificate has no direction, otherwise kTouching.
  //
  // For translations with a contact that ends before contact_time: no direction, and at most four
  // pairs. The hull of their differences meets 0 at some time between separated_until and
  // contact_time; so the differences at both times, at most eight points, have 0 in their hull.
  Boxed<Certificate> certificate;
};

// Finds the first contact of two hulls in motion. Exact if both motions are translations
// (IsTranslation) and both radii 0, grazes included: the time is rational, and the bracket has no
// double inside. Otherwise never a miss and never a false contact; the bracket is as narrow as
// requested, and the relation is kWithinTolerance only within the resolution. Swapping A and B
// mirrors the answer. Empty hulls are separated from everything.
//
// INVALID_ARGUMENT: ValidateMotion, ValidateMotionOptions; a radius is negative or not finite; no
// plane can be proven because a rotation nearly vanishes, or sizes are out of the range of
// kMotionMinSize and kMotionMaxSize. CANCELLED: should_stop returned true.
absl::StatusOr<FirstContact> FindFirstContact(const MovingHull& a, const MovingHull& b,
                                              const MotionOptions& options = {});

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_FIRST_CONTACT_H_
