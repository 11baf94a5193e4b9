#include "core/hull/hull.h"

#include <algorithm>
#include <utility>

namespace hulld {

Hull::Hull(int dimension, std::vector<Vector> vertices, std::vector<uint32_t> facet_starts,
           std::vector<uint32_t> facet_vertices, std::vector<Edge> edges)
    : dimension_(dimension),
      vertices_(std::move(vertices)),
      facet_starts_(std::move(facet_starts)),
      facet_vertices_(std::move(facet_vertices)),
      edges_(std::move(edges)) {
  for (const Vector& v : vertices_) {
    max_abs_coordinate_ = std::max(max_abs_coordinate_, v.cwiseAbs().maxCoeff());
  }
}

}  // namespace hulld
