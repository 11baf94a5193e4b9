#ifndef HULLD_SERVER_REGISTRY_INLINE_SHAPES_H_
#define HULLD_SERVER_REGISTRY_INLINE_SHAPES_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "core/numeric/vector.h"
#include "server/registry/registry.h"

namespace hulld::server {

// Points of the inline shapes of a call, by index.
class InlineShapes {
 public:
  // Requires: at least one point, all finite.
  void Add(std::span<const Vector> points) {
    points_.insert(points_.end(), points.begin(), points.end());
    ends_.push_back(points_.size());
  }

  bool empty() const { return ends_.empty(); }
  size_t size() const { return ends_.size(); }
  std::span<const Vector> PointsOf(size_t k) const {
    const size_t begin = k == 0 ? 0 : ends_[k - 1];
    return std::span(points_).subspan(begin, ends_[k] - begin);
  }
  size_t MemoryBytes() const {
    return points_.capacity() * sizeof(Vector) + ends_.capacity() * sizeof(size_t);
  }

 private:
  std::vector<Vector> points_;
  // Position in points_ after the last point of each shape.
  std::vector<size_t> ends_;
};

// Builds the hull of each shape, ready for all queries. Its record has no ID and no revision. It is
// charged to the readers' share of --memory-limit while a view references it. CANCELLED:
// should_stop returned true. RESOURCE_EXHAUSTED: readers exceed their share, and the hulls need
// more than a few hundred KiB. Cost: building the hulls.
absl::StatusOr<std::vector<HullView>> BuildInlineShapes(Registry& registry,
                                                        const InlineShapes& shapes,
                                                        const std::function<bool()>& should_stop);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_INLINE_SHAPES_H_
