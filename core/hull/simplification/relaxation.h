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

// Spreads chosen vertices of a hull of dimension 3 more evenly. Proves nothing: measure the quality
// of a choice afterwards.
//
// If the neighbors of a chosen vertex are fixed, the hull of all chosen vertices has the most
// volume with that vertex farthest along the sum of the area normals of the surrounding facets.
// Repeatedly moving all vertices there at once turns the irregular triangles of farthest first into
// nearly equilateral ones, as far as curvature permits, and these have the least error for their
// area. Crowded vertices protrude least, and removing one makes room for its neighbors. Source:
// Chen and Xu 2004, Optimal Delaunay Triangulations, for the place of most volume; Lloyd 1982,
// Least Squares Quantization in PCM, for moving all at once.
class Relaxation {
 public:
  // unit_points: the hull's vertices at unit scale. All arguments must outlive this object. If the
  // poll stopped, here or later, results are meaningless. Cost: O(V log V).
  Relaxation(const Hull& hull, std::span<const Vector> unit_points, StopPoll& poll);

  // Moves each of the chosen vertices once. Vertices may coincide, so fewer may be returned,
  // ascending. Returns nothing if the chosen vertices lie in a plane or the poll stopped. Cost: a
  // hull of the chosen vertices and a support point for each.
  std::optional<std::vector<uint32_t>> Move(std::span<const uint32_t> chosen);
  // Move, with some of the least protruding vertices removed, no two of them neighbors: about one
  // in 20.
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
