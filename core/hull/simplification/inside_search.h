#ifndef HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_SEARCH_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_SEARCH_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/hull/simplification/inside_order.h"
#include "core/hull/simplification/subset_hull.h"
#include "core/hull/simplification/unit_scale.h"
#include "core/hull/simplification/vertex_subset.h"

namespace hulld {

// Chooses vertices of a hull of dimension 2 or 3: few for a given error, or a given number for a
// small error.
//
// Starts with farthest first. For a solid, then tries to improve the choice: each attempt takes the
// previous attempt's vertices, spreads somewhat fewer of them more evenly (Relaxation), and
// continues farthest first until the error is reached or the vertices are used up. The best choice
// found counts, so the result is never worse than farthest first alone.
class InsideSearch {
 public:
  // max_error: the caller's length unit; 0: no limit. most: vertices, at least dimension + 1 and at
  // most the hull's. All arguments must outlive this object.
  InsideSearch(const Hull& hull, double max_error, size_t most, StopPoll& poll);

  // If the poll stopped, the result is meaningless. Cost: a small multiple of farthest first.
  void Run();
  const VertexChoice& best() const { return best_; }

 private:
  bool Reaches(const VertexChoice& choice) const { return choice.error <= max_error_; }
  void Improve();
  bool Consider(const VertexSubset& subset, double error);

  const Hull& hull_;
  const double max_error_;
  const size_t most_;
  StopPoll& poll_;
  const UnitScale scale_;
  InsideOrder order_;
  VertexChoice best_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_INSIDE_SEARCH_H_
