#include "core/query/body/meeting_pieces.h"

#include <algorithm>
#include <utility>

namespace hulld {

MeetingPieces::MeetingPieces(const QueryBody& a, const QueryBody& b, BoxOf box_of_a, BoxOf box_of_b)
    : a_(&a), b_(&b), box_of_a_(std::move(box_of_a)), box_of_b_(std::move(box_of_b)) {}

void MeetingPieces::BuildTree() {
  is_built_ = true;
  std::vector<Box> boxes(b_->pieces().size());
  for (uint32_t i = 0; i < boxes.size(); ++i) boxes[i] = box_of_b_(i);
  tree_ = BoxTree(boxes);
}

std::optional<PiecePair> MeetingPieces::Next() {
  if (!is_built_) BuildTree();
  for (;;) {
    for (; next_ < meeting_.size(); ++next_) {
      // An empty box intersects a box that covers all of space.
      const uint32_t piece = meeting_[next_];
      if (!b_->pieces()[piece].hull->empty()) return PiecePair{next_a_ - 1, meeting_[next_++]};
    }
    meeting_.clear();
    next_ = 0;
    if (next_a_ == a_->pieces().size()) return std::nullopt;
    const uint32_t piece = next_a_++;
    if (a_->pieces()[piece].hull->empty()) continue;
    tree_.AppendMeeting(box_of_a_(piece), 0, meeting_);
    std::sort(meeting_.begin(), meeting_.end());
  }
}

}  // namespace hulld
