#include "core/hull/hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/check.h"

namespace hulld {
namespace {

// The first vertex with the least coordinate and the last one with the largest, along each axis.
struct AxisExtremes {
  std::array<size_t, 3> low = {0, 0, 0};
  std::array<size_t, 3> high = {0, 0, 0};
};

// Requires: at least one vertex.
AxisExtremes ExtremesOf(std::span<const Vector> vertices) {
  AxisExtremes extremes;
  Vector least = vertices[0];
  Vector largest = vertices[0];
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vector& v = vertices[i];
    for (size_t k = 0; k < 3; ++k) {
      if (v[k] < least[k]) extremes.low[k] = i;
      if (v[k] >= largest[k]) extremes.high[k] = i;
    }
    least = least.cwiseMin(v);
    largest = largest.cwiseMax(v);
  }
  return extremes;
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
  if (vertices_.empty()) return;
  const AxisExtremes extremes = ExtremesOf(vertices_);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector& low = vertices_[extremes.low[k]];
    const Vector& high = vertices_[extremes.high[k]];
    max_abs_coordinate_ = std::max({max_abs_coordinate_, std::abs(low[k]), std::abs(high[k])});
    // Divides each point first, so that no sum overflows.
    center_ += low / 6 + high / 6;
  }
}

}  // namespace hulld
