#include "core/query/motion/moving_body.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstddef>

#include "core/base/check.h"

namespace hulld {

bool MovingBody::is_rounded() const {
  const auto has_radius = [](const BodyPiece& piece) { return piece.radius > 0; };
  return radius > 0 || std::ranges::any_of(body.pieces(), has_radius);
}

absl::Status MovingBody::Validate() const {
  const auto pieces = body.pieces();
  for (size_t i = 0; i < pieces.size(); ++i) {
    const auto& [q, t] = pieces[i].X_BP;
    if (q[1] == 0 && q[2] == 0 && q[3] == 0 && t.isZero(0)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "piece ", i,
        " of the body has a pose of its own, and motions of such bodies are not "
        "supported; give every piece the body's frame, or query the motions of its pieces"));
  }
  return absl::OkStatus();
}

MovingHull MovingBody::Piece(uint32_t index) const {
  HULLD_DCHECK(index < body.pieces().size());
  const BodyPiece& piece = body.pieces()[index];
  return {*piece.hull, X_WB, radius, piece.radius};
}

}  // namespace hulld
