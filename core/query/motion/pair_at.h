#ifndef HULLD_CORE_QUERY_MOTION_PAIR_AT_H_
#define HULLD_CORE_QUERY_MOTION_PAIR_AT_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <optional>

#include "core/query/floating/float_pair.h"
#include "core/query/ladder.h"
#include "core/query/motion/first_contact.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

namespace hulld {

// Two hulls in motion at a given time, for queries of hulls at rest; exact, without rounding of the
// poses. Not movable, because its parts refer to each other.
class PairAt {
 public:
  // Both hulls must outlive the result. Requires: neither hull is empty, valid motions
  // (ValidateMotion), and a time in [0, 1].
  PairAt(const MovingHull& a, const MovingHull& b, double time);
  PairAt(const PairAt&) = delete;
  PairAt& operator=(const PairAt&) = delete;

  const FloatPair& pair() const { return *pair_; }

  // Decides the relation of the hulls without their radii, exactly. CANCELLED: should_stop, which
  // may be empty, returned true.
  absl::StatusOr<Decision> DecideCores(const std::function<bool()>& should_stop) const;
  // Returns true if the separation of the rounded hulls is at most `length`, exactly. Errors: as
  // above.
  absl::StatusOr<bool> IsWithin(double length, const std::function<bool()>& should_stop) const;
  // Returns the relation of the rounded hulls, exactly, with its proof if requested. Errors: as
  // above.
  absl::StatusOr<Answer> Check(bool want_certificate,
                               const std::function<bool()>& should_stop) const;

 private:
  std::optional<PoseProduct> product_a_;
  std::optional<PoseProduct> product_b_;
  std::optional<PlacedHull> placed_a_;
  std::optional<PlacedHull> placed_b_;
  std::optional<FloatPair> pair_;
};

// Two hulls in motion at rounded poses of their frames. Keeps a hull in place while its pose stays
// the same.
class RoundedPair {
 public:
  // Both hulls must outlive the result. Requires: neither hull is empty, and valid motions.
  RoundedPair(const MovingHull& a, const MovingHull& b) : a_{&a}, b_{&b} {}
  RoundedPair(const RoundedPair&) = delete;
  RoundedPair& operator=(const RoundedPair&) = delete;

  // Returns the pair with its frames at these poses, valid until the next call.
  const FloatPair& At(const Pose& X_WA, const Pose& X_WB);

 private:
  struct Side {
    const MovingHull* moving;
    Pose X_WB = {};
    std::optional<PoseProduct> product = {};
    std::optional<PlacedHull> placed = {};

    void MoveTo(const Pose& pose);
  };

  Side a_;
  Side b_;
  std::optional<FloatPair> pair_;
};

// Returns the error of a search that was stopped by should_stop.
inline absl::Status MotionStopped() {
  return absl::CancelledError("the search for the first contact was cancelled");
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_PAIR_AT_H_
