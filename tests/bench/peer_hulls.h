#ifndef HULLD_TESTS_BENCH_PEER_HULLS_H_
#define HULLD_TESTS_BENCH_PEER_HULLS_H_

#include <cstddef>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::bench {

// The hulls of peer libraries, with the options their users choose for speed. Each returns the
// number of vertices of its hull. Copying the points into the peer's own type is not timed: it
// happens before.

// qhull, option Qt, on 3 doubles per point. Doubles, merges coplanar facets: inexact.
size_t QhullVertices(std::vector<double>& coordinates);

// CGAL convex_hull_3 with exact predicates and inexact constructions: exact up to points within
// facets, which it may keep.
class CgalPoints {
 public:
  explicit CgalPoints(const std::vector<Vector>& points);
  ~CgalPoints();
  CgalPoints(const CgalPoints&) = delete;
  CgalPoints& operator=(const CgalPoints&) = delete;
  size_t HullVertices() const;

 private:
  struct Data;
  Data* data_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_PEER_HULLS_H_
