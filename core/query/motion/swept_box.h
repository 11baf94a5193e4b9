#ifndef HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_
#define HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_

#include "core/query/box_tree.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_body.h"

namespace hulld {

// The bounding box of a placement in motion (world frame). Its bounds move linearly: at time t,
// they are (1 - t) start.low + t end.low and (1 - t) start.high + t end.high. The box of a turning
// placement is a cube around the origin of its frame.
struct MovingBox {
  Box start;
  Box end;

  // The smallest box that contains this one at all times.
  Box Around() const { return {start.low.cwiseMin(end.low), start.high.cwiseMax(end.high)}; }
};

// Returns a box that certainly contains the rounded hull at each time. For a translation, it
// consists of the bounding boxes at both ends (BoundingBox). A rotation may turn the hull in any
// direction, so its boxes are cubes. Empty for an empty hull. Requires: a valid motion.
MovingBox MovingBoxOf(const MovingHull& moving);
// Returns a box that certainly contains all pieces of the body at each time; see above.
MovingBox MovingBoxOf(const MovingBody& moving);

// Return a box that certainly contains the hull or body at all times.
inline Box SweptBox(const MovingHull& moving) { return MovingBoxOf(moving).Around(); }
inline Box SweptBox(const MovingBody& moving) { return MovingBoxOf(moving).Around(); }

// Returns false only if the boxes are disjoint at each time up to `until`. May return true for
// disjoint boxes whose gap is within rounding.
bool MayMeet(const MovingBox& a, const MovingBox& b, double until = 1);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_
