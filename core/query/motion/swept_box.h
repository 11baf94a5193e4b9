#ifndef HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_
#define HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_

#include "core/query/box_tree.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_body.h"

namespace hulld {

// Returns a box (world frame) that certainly contains the rounded hull at all times. For a
// translation, it is the least box around the boxes of both ends (BoundingBox); a rotation may turn
// the hull in any direction. Empty for an empty hull. Requires a valid motion.
Box SweptBox(const MovingHull& moving);
// Returns a box that certainly contains all pieces of the body at all times; see above.
Box SweptBox(const MovingBody& moving);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_
