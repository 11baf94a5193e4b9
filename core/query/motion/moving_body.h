#ifndef HULLD_CORE_QUERY_MOTION_MOVING_BODY_H_
#define HULLD_CORE_QUERY_MOTION_MOVING_BODY_H_

#include <cstdint>

#include "core/query/body/query_body.h"
#include "core/query/motion/first_contact.h"
#include "core/query/terms/motion.h"

namespace hulld {

// A body in motion, or a hull queried together with bodies. Its radius is added to that of each
// piece.
struct MovingBody {
  const QueryBody& body;
  Motion X_WB;
  double radius = 0;

  bool is_rounded() const;
  // Requires: a valid body, and the index of a piece.
  MovingHull Piece(uint32_t index) const;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_MOVING_BODY_H_
