#ifndef HULLD_TESTS_BENCH_HULLS_PEER_HULLS_H_
#define HULLD_TESTS_BENCH_HULLS_PEER_HULLS_H_

#include <cstddef>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::bench {

// Hulls of peer libraries, with the options that their users choose for speed. Each returns the
// number of vertices of its hull. The points are converted to the peer's own type beforehand, which
// is not timed.

// qhull, option Qt, on 3 doubles per point. Uses doubles and merges coplanar facets: inexact.
size_t QhullVertices(std::vector<double>& coordinates);

// CGAL convex_hull_3 with exact predicates and inexact constructions: exact except for points
// within facets, which it may keep.
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

// CGAL's Delaunay_triangulation_3 with fast location, recommended by CGAL's manual for hulls of
// dynamic points. Its hull consists of the neighbors of the infinite vertex; exact as above. (qhull
// has no supported way to add points to a hull.)
class CgalStream {
 public:
  CgalStream();
  ~CgalStream();
  CgalStream(const CgalStream&) = delete;
  CgalStream& operator=(const CgalStream&) = delete;
  void Insert(const Vector& point);
  size_t HullVertices() const;

 private:
  struct Data;
  Data* data_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_HULLS_PEER_HULLS_H_
