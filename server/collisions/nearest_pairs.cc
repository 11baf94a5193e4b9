#include "server/collisions/nearest_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hulld::server {
namespace {

// Ten times kDefaultRelativeMaxError, because the bound of a separation may exceed it by the
// rounding of its own computation.
constexpr double kRelativeError = 1e-11;

// Adds the pair to a heap of at most `limit` pairs; drops the greatest if the heap is full.
void AddBounded(const RankedPair& pair, size_t limit, std::vector<RankedPair>* heap) {
  if (heap->size() == limit) {
    if (!(pair < heap->front())) return;
    std::pop_heap(heap->begin(), heap->end());
    heap->pop_back();
  }
  heap->push_back(pair);
  std::push_heap(heap->begin(), heap->end());
}

}  // namespace

NearestPairs::NearestPairs(size_t limit, std::vector<Box> boxes, double max_error)
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

bool NearestPairs::MayBeNear(uint32_t a, uint32_t b) const {
  const Vector gaps = (boxes_[b].low - boxes_[a].high).cwiseMax(boxes_[a].low - boxes_[b].high);
  // The rounding of the norm is far below the tolerance in bound().
  return gaps.cwiseMax(0).norm() <= bound();
}

void NearestPairs::Add(const RankedPair& pair) {
  const std::lock_guard lock(mutex_);
  AddBounded(pair, limit_, &nearest_);
  if (nearest_.size() < limit_) return;
  const double farthest = nearest_.front().rank;
  bound_.store(farthest + max_error_ + kRelativeError * std::abs(farthest),
               std::memory_order_relaxed);
}

void NearestPairs::AddUnanswered(uint32_t a, uint32_t b) {
  const std::lock_guard lock(mutex_);
  AddBounded({std::numeric_limits<double>::infinity(), a, b, v1::RELATION_UNSPECIFIED}, limit_,
             &unanswered_);
}

std::vector<RankedPair> NearestPairs::Take() {
  const std::lock_guard lock(mutex_);
  std::sort_heap(nearest_.begin(), nearest_.end());
  std::sort_heap(unanswered_.begin(), unanswered_.end());
  nearest_.insert(nearest_.end(), unanswered_.begin(), unanswered_.end());
  unanswered_ = {};
  return std::move(nearest_);
}

size_t NearestPairs::MaxMemoryBytes(uint64_t pairs) const {
  // Vectors double their capacity. A pair is in one of the heaps.
  return boxes_.capacity() * sizeof(Box) +
         2 * sizeof(RankedPair) * std::min<uint64_t>(2 * uint64_t{limit_}, pairs);
}

}  // namespace hulld::server
