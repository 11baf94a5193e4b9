#include "core/query/motion/pair_at.h"

#include "core/query/collision.h"
#include "core/query/floating/float_search.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/query_options.h"

namespace hulld {
namespace {

bool IsAtRest(const Motion& motion) {
  return motion.start.q == motion.end.q && motion.start.t == motion.end.t;
}

void PlaceAt(const Pose& X_WB, const MovingHull& moving, std::optional<PoseProduct>& product,
             std::optional<PlacedHull>& placed) {
  if (IsIdentity(moving.X_BH) && moving.piece_radius == 0) {
    placed.emplace(moving.hull, X_WB, moving.radius);
    return;
  }
  product.emplace(X_WB, moving.X_BH);
  placed.emplace(moving.hull, *product, moving.radius, moving.piece_radius);
}

// The caller's pose has fewer bits than the same pose computed as a time of a motion.
void PlaceAt(double time, const MovingHull& moving, std::optional<PoseProduct>& product,
             std::optional<PlacedHull>& placed) {
  const auto& [start, end] = moving.X_WB;
  if (time == 0 || time == 1 || IsAtRest(moving.X_WB)) {
    PlaceAt(time == 1 ? end : start, moving, product, placed);
    return;
  }
  product.emplace(moving.X_WB, time, moving.X_BH);
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
      Decide(*pair_, 0, nullptr, Purpose::kEvidence, kEndsAtSign, should_stop, *decision);
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

void RoundedPair::Side::MoveTo(const Pose& pose) {
  if (placed && X_WB.q == pose.q && X_WB.t == pose.t) return;
  X_WB = pose;
  PlaceAt(X_WB, *moving, product, placed);
}

const FloatPair& RoundedPair::At(const Pose& X_WA, const Pose& X_WB) {
  a_.MoveTo(X_WA);
  b_.MoveTo(X_WB);
  return pair_.emplace(*a_.placed, *b_.placed);
}

}  // namespace hulld
