#include "server/collisions/ranked_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hulld::server {
namespace {

// Ten times kDefaultRelativeMaxError, because the bound of a separation may exceed it by the
// rounding of its own computation.
constexpr double kRelativeError = 1e-11;

void DropGreatest(std::vector<RankedPair>* heap) {
  std::pop_heap(heap->begin(), heap->end());
  heap->pop_back();
}

// Adds the pair to a heap of at most `limit` pairs. Drops the greatest pair if the heap is full.
void AddBounded(const RankedPair& pair, size_t limit, std::vector<RankedPair>* heap) {
  if (heap->size() == limit) {
    if (!(pair < heap->front())) return;
    DropGreatest(heap);
  }
  heap->push_back(pair);
  std::push_heap(heap->begin(), heap->end());
}

}  // namespace

RankedPairs::RankedPairs(size_t limit, std::vector<Box> boxes, double max_error)
    : limit_(limit),
      boxes_(std::move(boxes)),
      max_error_(max_error + std::numeric_limits<double>::denorm_min()) {
  double largest = 0;
  for (const Box& box : boxes_) {
    if (!box.IsEmpty()) largest = std::max(largest, (box.high - box.low).norm());
  }
  // The default error of a separation is relative to the sizes of both hulls.
  max_error_ += 4 * kRelativeError * largest;
}

RankedPairs::RankedPairs(MemoryCharge charge)
    : limit_(std::numeric_limits<size_t>::max()), charge_(std::move(charge)) {}

bool RankedPairs::MayBeNear(uint32_t a, uint32_t b) const {
  const Vector gaps = (boxes_[b].low - boxes_[a].high).cwiseMax(boxes_[a].low - boxes_[b].high);
  // The rounding of the norm is far below the tolerance in bound().
  return gaps.cwiseMax(0).norm() <= bound();
}

bool RankedPairs::Add(const RankedPair& pair, double contact_time) {
  const std::lock_guard lock(mutex_);
  earliest_.store(std::min(earliest(), contact_time), std::memory_order_relaxed);
  AddBounded(pair, limit_, &kept_);
  while (!kept_.empty() && kept_.front().rank > earliest()) DropGreatest(&kept_);
  if (kept_.size() == limit_) {
    const double farthest = kept_.front().rank;
    bound_.store(farthest + max_error_ + kRelativeError * std::abs(farthest),
                 std::memory_order_relaxed);
  }
  return Charge();
}

bool RankedPairs::AddUnanswered(uint32_t a, uint32_t b) {
  const std::lock_guard lock(mutex_);
  AddBounded({kNever, a, b, v1::RELATION_UNSPECIFIED}, limit_, &unanswered_);
  return Charge();
}

bool RankedPairs::Charge() {
  const uint64_t bytes = (kept_.capacity() + unanswered_.capacity()) * sizeof(RankedPair);
  if (!charge_.has_value() || bytes == charge_->bytes()) return false;
  charge_->Set(bytes);
  return true;
}

std::vector<RankedPair> RankedPairs::Take() {
  const std::lock_guard lock(mutex_);
  const bool is_limited = !charge_.has_value();
  if (!is_limited && earliest() == kNever) kept_.clear();
  std::sort_heap(kept_.begin(), kept_.end());
  std::sort_heap(unanswered_.begin(), unanswered_.end());
  kept_.insert(kept_.end(), unanswered_.begin(), unanswered_.end());
  unanswered_ = {};
  return std::move(kept_);
}

size_t RankedPairs::MaxMemoryBytes(uint64_t pairs) const {
  // Vectors double their capacity. Each pair is in only one of the heaps.
  return boxes_.capacity() * sizeof(Box) +
         2 * sizeof(RankedPair) * std::min<uint64_t>(2 * uint64_t{limit_}, pairs);
}

}  // namespace hulld::server
