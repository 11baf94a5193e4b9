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

// The vertices of a hull of dimension 2 or 3, farthest first, as far as anyone has asked.
class InsideOrder {
 public:
  // The hull and the poll must outlive this. After the poll said stop, its answers mean nothing.
  InsideOrder(const Hull& hull, const UnitScale& scale, StopPoll& poll);
  InsideOrder(const InsideOrder&) = delete;
  InsideOrder& operator=(const InsideOrder&) = delete;

  // The fewest vertices that this order begins with.
  size_t least() const { return least_; }
  // How many of the first vertices bring the error within `error`; `most` if that is not reached
  // before. Not less than least(). Requires most >= least().
  size_t CountFor(double error, size_t most);
  // Proven: no point of the hull is farther than this from the hull of the first `count` vertices.
  // The caller's length unit. Requires least() <= count <= the hull's vertices.
  double ErrorAt(size_t count);
  // The first `count`, by index.
  std::vector<uint32_t> First(size_t count);
  // True where the signs of determinants mostly are certain in floating point, of a solid; not at
  // extreme scales.
  bool IsMeasurable() const { return solid_ && solid_->IsMeasurable(); }
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
