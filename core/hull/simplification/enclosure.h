#ifndef HULLD_CORE_HULL_SIMPLIFICATION_ENCLOSURE_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_ENCLOSURE_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

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
  // Requires: a hull of dimension 2 or 3, and a poll; both must outlive this object. should_stop:
  // the function that the poll calls.
  Enclosure(const Hull& full, const UnitScale& scale, const std::function<bool()>& should_stop,
            StopPoll& poll);

  // Pushes each vertex of the inside hull outwards beyond the planes that support the full hull
  // along the vertex's facets; a polygon becomes a thin prism. The result has as many vertices as
  // the inside hull, twice as many for a polygon. Suits round shapes. Requires: the same dimension.
  std::optional<SimplifiedHull> ByPushing(const Hull& inside);
  // Intersects the half-spaces that support the full hull along the inside hull's facets. The
  // result has at most twice as many vertices as the inside hull has facets. Suits shapes with few
  // planes. Requires: dimension 3.
  std::optional<SimplifiedHull> ByPlanes(const Hull& inside);
  // Returns the box along the axes: 8 vertices, fewer for a shape that is flat along an axis.
  // Always has a value.
  std::optional<SimplifiedHull> ByBox();

 private:
  // A plane n . x = offset, n of unit length and outwards, of a facet of an inside hull, or of an
  // edge of a polygon; the largest extent of the full hull beyond it, and the vertex there.
  struct Plane {
    Vector normal;
    double offset;
    double gap;
    uint32_t farthest;
  };
  // A corner of a candidate, in the caller's unit except in CornersOf, and an approximately nearest
  // vertex of the full hull.
  struct Corner {
    Vector point;
    uint32_t near;
  };

  std::vector<uint32_t> PlacesOf(const Hull& inside) const;
  Plane MakePlane(const Vector& normal, const Vector& on_plane, uint32_t start) const;
  std::vector<Corner> CornersOf(std::span<const Plane> planes, const Vector& center) const;
  Corner CornerAt(const Vector& unit_point, uint32_t near) const {
    return {scale_.FromUnit(unit_point), near};
  }
  std::optional<SimplifiedHull> HullAround(std::span<const Corner> corners);
  bool HoldsAll(HullBuilder hull);

  const Hull& full_;
  const UnitScale scale_;
  const std::function<bool()>& should_stop_;
  StopPoll& poll_;
  // At unit scale.
  const std::vector<Vector> vertices_;
  const SupportFunction support_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_ENCLOSURE_H_
