#ifndef HULLD_CORE_HULL_SIMPLIFICATION_RELAXATION_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_RELAXATION_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/hull.h"
#include "core/hull/simplification/support_function.h"
#include "core/numeric/vector.h"

namespace hulld {

// Spreads chosen vertices of a hull of dimension 3 more evenly. It proves nothing: what a choice is
// worth is to be measured afterwards.
//
// Idea: while the neighbours of a chosen vertex stay, the hull of all chosen has the most volume
// with that vertex farthest along the sum of the area normals of the facets round it. Moving all
// there at once, some times, makes of the irregular triangles that farthest first leaves ones that
// are about equilateral, as far as curvature lets be, and these have the least error for their
// area. Where vertices are crowded they stick out least, and leaving one out makes room for the
// others. Source: Chen and Xu 2004, Optimal Delaunay Triangulations, for the place of most volume;
// Lloyd 1982, Least Squares Quantization in PCM, for moving all at once.
class Relaxation {
 public:
  // unit_points: the hull's vertices at unit scale. All given must outlive this. After the poll
  // said stop, here or later, the answers mean nothing. Cost: O(V log V).
  Relaxation(const Hull& hull, std::span<const Vector> unit_points, StopPoll& poll);

  // Moves each of the chosen vertices once; they may meet, so that fewer come back, ascending.
  // Nothing where the chosen lie in a plane, or the poll said stop. Cost: a hull of the chosen and
  // a support point of each.
  std::optional<std::vector<uint32_t>> Move(std::span<const uint32_t> chosen);
  // The same, without some of those that stick out least, no two of them neighbours: about one in
  // 20.
  std::optional<std::vector<uint32_t>> MoveFewer(std::span<const uint32_t> chosen);

 private:
  std::optional<std::vector<uint32_t>> Move(std::span<const uint32_t> chosen, bool leave_out);
  std::vector<uint32_t> Ascending(std::span<const uint32_t> chosen) const;
  static std::vector<bool> FindFlattest(const Hull& inside, std::span<const Vector> points,
                                        std::span<const Vector> normals);

  const Hull& hull_;
  const std::span<const Vector> unit_points_;
  StopPoll& poll_;
  const SupportFunction support_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_RELAXATION_H_
