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

// A hull at a fixed pose in the frame of its body, with the radius of a rounded hull.
struct BodyPiece {
  const QueryHull* hull;
  Pose X_BP;
  double radius = 0;
};

// A box for each piece, in the body's frame, and a tree of these boxes. Keeps no reference to the
// hulls, so it remains valid as long as their points do not change. Immutable.
class PieceBoxes {
 public:
  // Requires: valid poses and radii (PlacedHull checks them). Cost: O(n log n) and six support
  // points for each piece.
  explicit PieceBoxes(std::span<const BodyPiece> pieces);

  // Indexed by piece; boxes of empty hulls are empty.
  const BoxTree& tree() const { return tree_; }
  // Contains all pieces. Covers all of space if coordinates are beyond the range of doubles. Empty
  // if all pieces are empty.
  Box all() const { return tree_.empty() ? Box::Empty() : tree_.box(0); }
  // Largest absolute coordinate; infinite if a box covers all of space.
  double size() const { return size_; }
  size_t MemoryBytes() const { return sizeof(*this) + tree_.MemoryBytes(); }

 private:
  BoxTree tree_{std::span<const Box>()};
  double size_ = 0;
};

// A body in the form that queries need: its pieces and their boxes. It may also wrap a single hull
// that is queried together with bodies; the hull is then its only piece, without a pose of its own.
// The hulls must outlive it. Immutable and thread-safe.
class QueryBody {
 public:
  // Builds a body from zero or more pieces. Requires: valid poses, and boxes built from the same
  // pieces or from pieces that differ only in hulls of the same point sets (unchecked except for
  // the count: a check would rebuild the boxes).
  QueryBody(std::vector<BodyPiece> pieces, std::shared_ptr<const PieceBoxes> boxes)
      : is_hull_(false), pieces_(std::move(pieces)), boxes_(std::move(boxes)) {
    HULLD_DCHECK(boxes_ != nullptr && boxes_->tree().empty() == pieces_.empty());
  }
  // Builds the boxes as well.
  explicit QueryBody(std::vector<BodyPiece> pieces);
  // Wraps a hull. Cost: six support points.
  explicit QueryBody(const QueryHull& hull);
  explicit QueryBody(const QueryHull&&) = delete;

  // True if this wraps a hull, the only piece, without a pose of its own.
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
