#include "core/query/motion/pair_at.h"

#include "core/query/certification.h"
#include "core/query/exact/exact_pair.h"

namespace hulld {
namespace {

bool IsAtRest(const Motion& motion) {
  return motion.start.q == motion.end.q && motion.start.t == motion.end.t;
}

// Places a hull. A pose of the caller has fewer bits than the same pose as a time of a motion.
void PlaceAt(double time, const MovingHull& moving, std::optional<PoseProduct>& product,
             std::optional<PlacedHull>& placed) {
  if (time == 0 || IsAtRest(moving.X_WH)) {
    placed.emplace(moving.hull, moving.X_WH.start);
  } else if (time == 1) {
    placed.emplace(moving.hull, moving.X_WH.end);
  } else {
    product.emplace(moving.X_WH, time);
    placed.emplace(moving.hull, *product);
  }
}

}  // namespace

PairAt::PairAt(const MovingHull& a, const MovingHull& b, double time) {
  PlaceAt(time, a, product_a_, placed_a_);
  PlaceAt(time, b, product_b_, placed_b_);
  pair_.emplace(*placed_a_, *placed_b_);
}

absl::StatusOr<Decision> PairAt::Decide(const std::function<bool()>& should_stop) const {
  absl::StatusOr<Decision> decision(absl::in_place);
  if (absl::Status s =
          hulld::Decide(*pair_, 0, nullptr, Purpose::kEvidence, should_stop, *decision);
      !s.ok()) {
    return s;
  }
  return decision;
}

absl::StatusOr<Certificate> PairAt::Certify(const Decision& decision,
                                            const std::function<bool()>& should_stop) const {
  ExactPair exact(*pair_, should_stop);
  return MakeCertificate(exact, decision, should_stop);
}

}  // namespace hulld
