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

// Makes hulls that enclose a given one, exactly for the doubles that they hold, from hulls of some
// of its vertices. What encloses is guessed in floating point, checked exactly, and pushed outwards
// until the check passes. Each answer is nothing where it never passes, or where the caller said
// stop.
class Enclosure {
 public:
  // Requires a hull of dimension 2 or 3 and a poll, which outlive this. should_stop: what the poll
  // asks.
  Enclosure(const Hull& full, const UnitScale& scale, const std::function<bool()>& should_stop,
            StopPoll& poll);

  // The inside hull's vertices, each pushed outwards until it reaches beyond the planes that
  // support the full hull along its own facets; a polygon becomes a thin prism. As many vertices as
  // the inside hull, twice as many for a polygon. Suits what is round. Requires the same dimension.
  std::optional<SimplifiedHull> ByPushing(const Hull& inside);
  // The intersection of the half-spaces that support the full hull along the inside hull's facets.
  // At most twice as many vertices as the inside hull has facets. Suits what is made of few planes.
  // Requires dimension 3.
  std::optional<SimplifiedHull> ByPlanes(const Hull& inside);
  // The box along the axes: 8 vertices, less for what is flat along an axis. Never nothing.
  std::optional<SimplifiedHull> ByBox();

 private:
  // A plane n . x = offset, n of unit length and outwards, of a facet of an inside hull, or of an
  // edge of a polygon; how far the full hull reaches beyond it, and at which vertex.
  struct Plane {
    Vector normal;
    double offset;
    double gap;
    uint32_t farthest;
  };
  // A point to enclose with, mostly in the caller's unit, and a vertex of the full hull that is
  // about nearest.
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
