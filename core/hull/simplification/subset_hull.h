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

// Some of a hull's vertices, by index and each once, and what their hull is worth for the whole.
struct VertexChoice {
  std::vector<uint32_t> vertices;
  // Proven: no point of the hull is farther than this from the hull of these. The caller's length
  // unit.
  double error = 0;
};

// The hull of some of a hull's vertices; nothing when the poll said stop. All of them are vertices
// of it, as each is extreme among all.
std::optional<Hull> HullOfSubset(const Hull& full, std::span<const uint32_t> chosen,
                                 StopPoll& poll);

// Twice the area of a facet times its unit normal; rounded. Newell's sum, which many corners do not
// spoil.
Vector AreaNormal(std::span<const Vector> points, std::span<const uint32_t> loop);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_SUBSET_HULL_H_
