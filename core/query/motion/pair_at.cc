#include "core/query/motion/pair_at.h"

#include "core/query/collision.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/query_options.h"

namespace hulld {
namespace {

bool IsAtRest(const Motion& motion) {
  return motion.start.q == motion.end.q && motion.start.t == motion.end.t;
}

// Places a hull. A pose of the caller has fewer bits than the same pose as a time of a motion.
void PlaceAt(double time, const MovingHull& moving, std::optional<PoseProduct>& product,
             std::optional<PlacedHull>& placed) {
  const auto& [start, end] = moving.X_WB;
  const bool is_given = time == 0 || time == 1 || IsAtRest(moving.X_WB);
  const Pose& given = time == 1 ? end : start;
  if (is_given && IsIdentity(moving.X_BH) && moving.piece_radius == 0) {
    placed.emplace(moving.hull, given, moving.radius);
    return;
  }
  if (is_given) {
    product.emplace(given, moving.X_BH);
  } else {
    product.emplace(moving.X_WB, time, moving.X_BH);
  }
  placed.emplace(moving.hull, *product, moving.radius, moving.piece_radius);
}

}  // namespace

PairAt::PairAt(const MovingHull& a, const MovingHull& b, double time) {
  PlaceAt(time, a, product_a_, placed_a_);
  PlaceAt(time, b, product_b_, placed_b_);
  pair_.emplace(*placed_a_, *placed_b_);
}

absl::StatusOr<Decision> PairAt::DecideCores(const std::function<bool()>& should_stop) const {
  absl::StatusOr<Decision> decision(absl::in_place);
  const absl::Status status =
      Decide(*pair_, 0, nullptr, Purpose::kEvidence, should_stop, *decision);
  if (!status.ok()) decision = status;
  return decision;
}

absl::StatusOr<bool> PairAt::IsWithin(double length,
                                      const std::function<bool()>& should_stop) const {
  QueryOptions options;
  options.clearance = length;
  options.should_stop = should_stop;
  const absl::StatusOr<Answer> answer = CheckCollision(*placed_a_, *placed_b_, options);
  if (!answer.ok()) return answer.status();
  return answer->within_clearance.value();
}

absl::StatusOr<Answer> PairAt::Check(bool want_certificate,
                                     const std::function<bool()>& should_stop) const {
  QueryOptions options;
  options.want_certificate = want_certificate;
  options.should_stop = should_stop;
  return CheckCollision(*placed_a_, *placed_b_, options);
}

}  // namespace hulld
