#include "server/collisions/first_pairs.h"

#include <algorithm>
#include <cmath>

namespace hulld::server {
namespace {

// Later pairs are dropped once the pairs have doubled in number, from this on. A choice.
constexpr size_t kLeastToDrop = 1024;

}  // namespace

bool FirstPairs::Add(const RankedPair& pair, double contact_time) {
  const std::lock_guard lock(mutex_);
  earliest_ = std::min(earliest_, contact_time);
  if (pair.rank > earliest_) return false;
  pairs_.push_back(pair);
  if (pairs_.size() >= std::max(2 * kept_, kLeastToDrop)) DropLater();
  return Charge();
}

bool FirstPairs::AddUnanswered(uint32_t a, uint32_t b) {
  const std::lock_guard lock(mutex_);
  unanswered_.push_back({std::numeric_limits<double>::infinity(), a, b, v1::RELATION_UNSPECIFIED});
  return Charge();
}

std::vector<RankedPair> FirstPairs::Take() {
  const std::lock_guard lock(mutex_);
  DropLater();
  if (std::isinf(earliest_)) pairs_.clear();
  std::sort(pairs_.begin(), pairs_.end());
  std::sort(unanswered_.begin(), unanswered_.end());
  pairs_.insert(pairs_.end(), unanswered_.begin(), unanswered_.end());
  unanswered_ = {};
  return std::move(pairs_);
}

void FirstPairs::DropLater() {
  std::erase_if(pairs_, [this](const RankedPair& pair) { return pair.rank > earliest_; });
  kept_ = pairs_.size();
}

bool FirstPairs::Charge() {
  const uint64_t bytes = (pairs_.capacity() + unanswered_.capacity()) * sizeof(RankedPair);
  if (bytes == charge_.bytes()) return false;
  charge_.Set(bytes);
  return true;
}

}  // namespace hulld::server
