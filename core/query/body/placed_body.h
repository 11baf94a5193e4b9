#ifndef HULLD_CORE_QUERY_BODY_PLACED_BODY_H_
#define HULLD_CORE_QUERY_BODY_PLACED_BODY_H_

#include <cstdint>
#include <optional>

#include "core/base/check.h"
#include "core/query/body/query_body.h"
#include "core/query/box_tree.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

namespace hulld {

// A body, or a hull queried together with bodies, at a pose. Its radius is added to that of each
// piece. Pieces are placed on demand.
class PlacedBody {
 public:
  // `body` must outlive the result. Requires: a valid pose (ValidatePose), and a radius that is
  // finite and not negative.
  PlacedBody(const QueryBody& body, const Pose& X_WB, double radius = 0)
      : body_(&body), X_WB_(X_WB), radius_(radius) {
    HULLD_DCHECK(IsValidPose(X_WB));
  }
  PlacedBody(const QueryBody&&, const Pose&, double = 0) = delete;

  const QueryBody& body() const { return *body_; }
  const Pose& X_WB() const { return X_WB_; }
  double radius() const { return radius_; }

 private:
  const QueryBody* body_;
  Pose X_WB_;
  double radius_;
};

// One piece in the world. Not movable: the placed hull refers to the pose stored here.
class PlacedPiece {
 public:
  // Requires: `index` is the index of a piece. The hull of the piece must outlive the result.
  PlacedPiece(const PlacedBody& body, uint32_t index) {
    HULLD_DCHECK(index < body.body().pieces().size());
    const BodyPiece& piece = body.body().pieces()[index];
    if (body.body().is_hull()) {
      placed_.emplace(*piece.hull, body.X_WB(), body.radius());
      return;
    }
    product_.emplace(body.X_WB(), piece.X_BP);
    placed_.emplace(*piece.hull, *product_, body.radius(), piece.radius);
  }
  PlacedPiece(const PlacedPiece&) = delete;
  PlacedPiece& operator=(const PlacedPiece&) = delete;

  const PlacedHull& placed() const { return *placed_; }

 private:
  std::optional<PoseProduct> product_;
  std::optional<PlacedHull> placed_;
};

// A piece of A and a piece of B, by index; 0 for a hull.
struct PiecePair {
  uint32_t a;
  uint32_t b;
  friend bool operator==(const PiecePair&, const PiecePair&) = default;
};

// Returns a box (world frame) that certainly contains all pieces; larger than the smallest such box
// if the body is rotated. Covers all of space if coordinates are beyond the range of doubles. Empty
// if all pieces are empty.
Box BoundingBox(const PlacedBody& placed);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_PLACED_BODY_H_
