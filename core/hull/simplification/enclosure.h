#ifndef HULLD_CORE_HULL_SIMPLIFICATION_ENCLOSURE_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_ENCLOSURE_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "core/base/stop_poll.h"
#include "core/hull/growth/hull_builder.h"
#include "core/hull/hull.h"
#include "core/hull/simplification/simplify.h"
#include "core/hull/simplification/support_function.h"
#include "core/hull/simplification/unit_scale.h"
#include "core/numeric/vector.h"

namespace hulld {

// Builds hulls that enclose a given one, exactly for the doubles that they store, from hulls of
// some of its vertices. A candidate is computed in floating point, checked exactly, and pushed
// outwards until the check passes. A function returns nothing if the check never passes or the poll
// stopped.
class Enclosure {
 public:
  // Requires: a hull of dimension 2 or 3, its vertices at unit scale, and a poll; all must outlive
  // this object. should_stop: the function that the poll calls.
  Enclosure(const Hull& full, std::span<const Vector> unit_points, const UnitScale& scale,
            const std::function<bool()>& should_stop, StopPoll& poll);

  // Pushes each vertex of the inside hull outwards beyond the planes that support the full hull
  // along the vertex's facets; a polygon becomes a thin prism. The result has as many vertices as
  // the inside hull, twice as many for a polygon. Also returns nothing if the error would exceed
  // max_error, in the caller's length unit. Requires: the same dimension.
  std::optional<SimplifiedHull> ByPushing(const Hull& inside, double max_error);
  // Returns the box along the axes: 8 vertices, fewer for a shape that is flat along an axis.
  // Always has a value.
  std::optional<SimplifiedHull> ByBox();

 private:
  // A corner of a candidate, in the caller's unit, and an approximately nearest vertex of the full
  // hull.
  struct Corner {
    Vector point;
    uint32_t near;
  };

  Corner CornerAt(const Vector& unit_point, uint32_t near) const {
    return {scale_.FromUnit(unit_point), near};
  }
  std::optional<SimplifiedHull> HullAround(std::span<const Corner> corners);
  bool ContainsAll(HullBuilder hull);

  const Hull& full_;
  const std::span<const Vector> unit_points_;
  const UnitScale scale_;
  const std::function<bool()>& should_stop_;
  StopPoll& poll_;
  const SupportFunction support_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_ENCLOSURE_H_
