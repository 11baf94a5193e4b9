#ifndef HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_ORDER_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_ORDER_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/hull/simplification/polygon_subset.h"
#include "core/hull/simplification/unit_scale.h"
#include "core/hull/simplification/vertex_subset.h"

namespace hulld {

// The vertices of a hull of dimension 2 or 3, farthest first, computed on demand.
class InsideOrder {
 public:
  // The hull and the poll must outlive this object. If the poll stopped, results are meaningless.
  InsideOrder(const Hull& hull, const UnitScale& scale, StopPoll& poll);
  InsideOrder(const InsideOrder&) = delete;
  InsideOrder& operator=(const InsideOrder&) = delete;

  // The number of vertices that this order starts with, which is the fewest that it supports.
  size_t least() const { return least_; }
  // Returns the number of leading vertices that reduce the error to `error`, or `max_count` if more
  // would be needed. At least least(). Requires: most >= least().
  size_t CountFor(double error, size_t max_count);
  // Returns a **proven** bound, in the caller's length unit, on the distance of any point of the
  // hull from the hull of the first `count` vertices. Requires: least() <= count <= the hull's
  // vertices.
  double ErrorAt(size_t count);
  // Returns the first `count` vertices, by index.
  std::vector<uint32_t> First(size_t count);
  // The hull's vertices at unit scale.
  std::span<const Vector> unit_points() const { return unit_points_; }

 private:
  const std::vector<uint32_t>& chosen() const {
    return polygon_ ? polygon_->chosen() : solid_->chosen();
  }
  void ExtendTo(size_t count);
  void NoteError();

  const Hull& hull_;
  const UnitScale scale_;
  StopPoll& poll_;
  std::vector<Vector> unit_points_;
  std::optional<PolygonSubset> polygon_;
  std::optional<VertexSubset> solid_;
  size_t least_ = 0;
  // By count - least_.
  std::vector<double> errors_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_ORDER_H_
