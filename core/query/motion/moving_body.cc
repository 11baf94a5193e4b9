#include "core/query/motion/moving_body.h"

#include <algorithm>

#include "core/base/check.h"

namespace hulld {

bool MovingBody::is_rounded() const {
  const auto has_radius = [](const BodyPiece& piece) { return piece.radius > 0; };
  return radius > 0 || std::ranges::any_of(body.pieces(), has_radius);
}

MovingHull MovingBody::Piece(uint32_t index) const {
  HULLD_DCHECK(index < body.pieces().size());
  const BodyPiece& piece = body.pieces()[index];
  return {*piece.hull, X_WB, radius, piece.X_BP, piece.radius};
}

}  // namespace hulld
