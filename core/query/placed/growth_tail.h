#ifndef HULLD_CORE_QUERY_PLACED_GROWTH_TAIL_H_
#define HULLD_CORE_QUERY_PLACED_GROWTH_TAIL_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/check.h"
#include "core/numeric/vector.h"
#include "core/query/placed/hull_base.h"
#include "core/query/placed/support_blocks.h"

namespace hulld {

// An append-only array of points with fixed capacity. One thread appends; any number of threads
// read prefixes whose size was published to them.
class GrowthTail {
 public:
  // `center`: the point from which distances are measured.
  GrowthTail(size_t capacity, const Vector& center)
      : blocks_((capacity + 3) / 4), radii_(4 * blocks_.size()), center_(center) {}

  size_t capacity() const { return radii_.size(); }
  size_t size() const { return size_; }  // for the thread that appends
  const Vector& center() const { return center_; }

  // Requires: size() < capacity().
  void Append(const Vector& p) {
    HULLD_DCHECK(size_ < capacity());
    blocks_[size_ / 4].Set(size_ % 4, p);
    const double radius = RadiusTo(p - center_);
    radii_[size_] = size_ == 0 ? radius : std::max(radii_[size_ - 1], radius);
    ++size_;
  }

  Vector point(size_t i) const { return blocks_[i / 4].point(i % 4); }
  // Returns the largest distance of the first `count` points from the center; rounded up.
  double RadiusOf(size_t count) const { return count == 0 ? 0 : radii_[count - 1]; }
  // Returns the farthest of the first `count` points.
  SupportPoint Farthest(size_t count, const PlainVector& n) const {
    return FarthestOf(blocks_, count, n);
  }
  const std::vector<SupportBlock>& blocks() const { return blocks_; }
  size_t MemoryBytes() const {
    return sizeof(*this) + blocks_.capacity() * sizeof(SupportBlock) +
           radii_.capacity() * sizeof(double);
  }

 private:
  std::vector<SupportBlock> blocks_;
  std::vector<double> radii_;
  const Vector center_;
  size_t size_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_GROWTH_TAIL_H_
