#ifndef HULLD_CORE_HULL_SIMPLIFICATION_SUBSET_HULL_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_SUBSET_HULL_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/numeric/vector.h"

namespace hulld {

// Distinct vertices of a hull, by index, and the quality of their hull as an approximation.
struct VertexChoice {
  std::vector<uint32_t> vertices;
  // A **proven** bound, in the caller's length unit, on the distance of any point of the hull from
  // the hull of these vertices.
  double error = 0;
};

// Returns the hull of some of a hull's vertices, or nothing if the poll stopped. All of them are
// vertices of the result, because each is extreme among all.
std::optional<Hull> HullOfSubset(const Hull& full, std::span<const uint32_t> chosen,
                                 StopPoll& poll);

// Returns the indices of the inside hull's vertices in the full hull, which contains all of them.
std::vector<uint32_t> PlacesOf(const Hull& inside, const Hull& full);

// Returns twice the area of a facet times its unit normal, rounded. Computed by Newell's method,
// which is robust for many corners.
Vector AreaNormal(std::span<const Vector> points, std::span<const uint32_t> loop);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_SUBSET_HULL_H_
