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

// Points that were appended to a base, prepared. Immutable.
struct PreparedLevel {
  PreparedLevel(MappedPoints mapped_in, double radius_in)
      : mapped(std::move(mapped_in)), radius(radius_in) {}

  const MappedPoints mapped;
  // The radius of the points about the base's centre.
  const double radius;
};

// What a LiveHull consists of between two changes of its structure. Immutable, but for the tail,
// which grows.
struct LiveParts {
  // Null as long as nothing was appended.
  std::shared_ptr<const HullBase> base;
  // The larger come first.
  std::vector<std::shared_ptr<const PreparedLevel>> levels;
  // How many of the appended points base and levels stand for; the tail has those after.
  uint64_t covered = 0;
  // Null as long as there are none.
  std::shared_ptr<GrowthTail> tail;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_LIVE_PARTS_H_
