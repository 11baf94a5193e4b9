#ifndef HULLD_CORE_QUERY_PLACED_LIVE_PARTS_H_
#define HULLD_CORE_QUERY_PLACED_LIVE_PARTS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/query/placed/growth_tail.h"
#include "core/query/placed/hull_base.h"

namespace hulld {

// Prepared points that were appended to a base. Immutable.
struct PreparedLevel {
  PreparedLevel(MappedPoints mapped_in, double radius_in)
      : mapped(std::move(mapped_in)), radius(radius_in) {}

  const MappedPoints mapped;
  // Radius of the points about the base's center.
  const double radius;
};

// The parts of a LiveHull between two changes of its structure. Immutable, except for the growing
// tail.
struct LiveParts {
  // Null before the first append.
  std::shared_ptr<const HullBase> base;
  // Larger levels come first.
  std::vector<std::shared_ptr<const PreparedLevel>> levels;
  // Number of appended points that base and levels represent; the tail contains the later ones.
  uint64_t covered = 0;
  // Null while empty.
  std::shared_ptr<GrowthTail> tail;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_LIVE_PARTS_H_
