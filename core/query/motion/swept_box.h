#ifndef HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_
#define HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_

#include "core/query/box_tree.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_body.h"

namespace hulld {

// Returns a box (world frame) that certainly contains the rounded hull at all times. Of a
// translation, the least box around those of both ends, as by BoundingBox; with a rotation, the
// hull may point in any direction. Empty for an empty hull. Requires a valid motion.
Box SweptBox(const MovingHull& moving);
// As above, of all pieces.
Box SweptBox(const MovingBody& moving);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_SWEPT_BOX_H_
