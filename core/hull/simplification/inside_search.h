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
// Idea: farthest first, and then, for a solid, attempts to do better: some fewer vertices, spread
// more evenly (Relaxation), and again farthest first from there, until the error is reached or the
// vertices are used up. The best of all that came up counts, so nothing is worse than farthest
// first alone. Each attempt goes on from where the last one ended.
class InsideSearch {
 public:
  // max_error: the caller's length unit; 0: none to reach. most: vertices, at least dimension + 1
  // and at most the hull's. All given must outlive this.
  InsideSearch(const Hull& hull, double max_error, size_t most, StopPoll& poll);

  // After the poll said stop, the answer means nothing. Cost: that of farthest first, some times
  // over.
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
