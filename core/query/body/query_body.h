#ifndef HULLD_CORE_QUERY_BODY_QUERY_BODY_H_
#define HULLD_CORE_QUERY_BODY_QUERY_BODY_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/query/box_tree.h"
#include "core/query/placed/query_hull.h"
#include "core/query/terms/pose.h"

namespace hulld {

// A hull at a fixed pose in the frame of its body.
struct BodyPiece {
  const QueryHull* hull;
  Pose X_BP;
};

// A box about each piece, in the body's frame, and a tree of these. It refers to no hull, so that
// it may be kept as long as the points of the hulls stay the same. Immutable.
class PieceBoxes {
 public:
  // Requires valid poses (ValidatePose; PlacedHull checks them). Cost: O(n log n) and six support
  // points for each piece.
  explicit PieceBoxes(std::span<const BodyPiece> pieces);

  // By the index of the piece; the boxes of empty hulls are empty.
  const BoxTree& tree() const { return tree_; }
  // Holds all pieces; all of space where doubles do not reach, empty where all pieces are.
  Box all() const { return tree_.empty() ? Box::Empty() : tree_.box(0); }
  // The largest absolute coordinate; infinite where a box is all of space.
  double size() const { return size_; }
  size_t MemoryBytes() const { return sizeof(*this) + tree_.MemoryBytes(); }

 private:
  BoxTree tree_{std::span<const Box>()};
  double size_ = 0;
};

// A body as questions need it: its pieces and their boxes. Or a hull, which is asked about together
// with bodies: it is its own one piece, at no pose but that of where it is placed. The hulls must
// outlive it. Immutable; readable by any thread.
class QueryBody {
 public:
  // A body of these pieces, perhaps none. Requires valid poses, and boxes that were made of the
  // same pieces, or of others with the same hulls as point sets (unchecked but for the size: only
  // making the boxes again would tell).
  QueryBody(std::vector<BodyPiece> pieces, std::shared_ptr<const PieceBoxes> boxes)
      : is_hull_(false), pieces_(std::move(pieces)), boxes_(std::move(boxes)) {
    HULLD_DCHECK(boxes_ != nullptr && boxes_->tree().empty() == pieces_.empty());
  }
  // The same; makes the boxes.
  explicit QueryBody(std::vector<BodyPiece> pieces);
  // A hull. Cost: six support points.
  explicit QueryBody(const QueryHull& hull);

  // Whether it is a hull, whose one piece has no pose of its own.
  bool is_hull() const { return is_hull_; }
  std::span<const BodyPiece> pieces() const { return pieces_; }
  const PieceBoxes& boxes() const { return *boxes_; }
  const BoxTree& tree() const { return boxes_->tree(); }

 private:
  bool is_hull_;
  std::vector<BodyPiece> pieces_;
  std::shared_ptr<const PieceBoxes> boxes_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_QUERY_BODY_H_
