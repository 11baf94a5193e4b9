#ifndef HULLD_CORE_QUERY_BODY_MEETING_PIECES_H_
#define HULLD_CORE_QUERY_BODY_MEETING_PIECES_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/query/body/placed_body.h"
#include "core/query/body/query_body.h"
#include "core/query/box_tree.h"

namespace hulld {

// The pairs of a piece of A and a piece of B whose boxes intersect, without empty hulls, in
// ascending order of A's piece, then B's.
class MeetingPieces {
 public:
  // Returns the box of a piece.
  using BoxOf = std::function<Box(uint32_t)>;

  // Both bodies must outlive this object. The boxes are computed on demand.
  MeetingPieces(const QueryBody& a, const QueryBody& b, BoxOf box_of_a, BoxOf box_of_b);

  // Returns the next pair; none after the last. Cost: O(log n) plus the box of each piece of A; the
  // first call computes the boxes of B, too.
  std::optional<PiecePair> Next();

  size_t MemoryBytes() const {
    return sizeof *this + tree_.MemoryBytes() + meeting_.capacity() * sizeof(uint32_t);
  }

 private:
  void BuildTree();

  const QueryBody* a_;
  const QueryBody* b_;
  BoxOf box_of_a_;
  BoxOf box_of_b_;
  bool is_built_ = false;
  BoxTree tree_{std::span<const Box>()};
  // Pieces of B that meet the piece of A before next_a_, and the position of the next of them.
  std::vector<uint32_t> meeting_;
  size_t next_ = 0;
  uint32_t next_a_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_MEETING_PIECES_H_
