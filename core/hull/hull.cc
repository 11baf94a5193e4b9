#include "core/hull/hull.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace hulld {
namespace {

Vector MeanOfAxisExtremes(const std::vector<Vector>& vertices) {
  Vector mean = Vector::Zero();
  for (int axis = 0; axis < 3 && !vertices.empty(); ++axis) {
    const auto [low, high] =
        std::minmax_element(vertices.begin(), vertices.end(),
                            [axis](const Vector& a, const Vector& b) { return a[axis] < b[axis]; });
    // Divides each point first, so that no sum overflows.
    mean += *low / 6 + *high / 6;
  }
  return mean;
}

}  // namespace

Hull::Hull(int dimension, std::vector<Vector> vertices, std::vector<uint32_t> facet_starts,
           std::vector<uint32_t> facet_vertices, std::vector<Edge> edges)
    : dimension_(dimension),
      vertices_(std::move(vertices)),
      facet_starts_(std::move(facet_starts)),
      facet_vertices_(std::move(facet_vertices)),
      edges_(std::move(edges)) {
  HULLD_CHECK(dimension_ >= -1 && dimension_ <= 3);
  HULLD_CHECK(facet_starts_.empty() || facet_starts_.back() == facet_vertices_.size());
  for (const Vector& v : vertices_) {
    max_abs_coordinate_ = std::max(max_abs_coordinate_, v.cwiseAbs().maxCoeff());
  }
  center_ = MeanOfAxisExtremes(vertices_);
}

}  // namespace hulld
