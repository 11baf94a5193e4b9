#include "core/query/body/query_body.h"

#include <algorithm>

#include "core/query/placed/placed_hull.h"

namespace hulld {

PieceBoxes::PieceBoxes(std::span<const BodyPiece> pieces) {
  std::vector<Box> boxes;
  boxes.reserve(pieces.size());
  for (const BodyPiece& piece : pieces) {
    const Box box = BoundingBox(PlacedHull(*piece.hull, piece.X_BP, piece.radius));
    boxes.push_back(box);
    if (box.IsEmpty()) continue;
    size_ = std::max({size_, box.low.cwiseAbs().maxCoeff(), box.high.cwiseAbs().maxCoeff()});
  }
  tree_ = BoxTree(boxes);
}

QueryBody::QueryBody(std::vector<BodyPiece> pieces)
    : is_hull_(false),
      pieces_(std::move(pieces)),
      boxes_(std::make_shared<const PieceBoxes>(pieces_)) {}

QueryBody::QueryBody(const QueryHull& hull)
    : is_hull_(true),
      pieces_({{&hull, Pose()}}),
      boxes_(std::make_shared<const PieceBoxes>(pieces_)) {}

}  // namespace hulld
