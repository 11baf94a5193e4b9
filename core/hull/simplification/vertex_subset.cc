#include "core/hull/simplification/vertex_subset.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/base/check.h"
#include "core/hull/simplification/triangle_distance.h"

namespace hulld {
namespace {

// The point of `candidates` for which `measure` is largest.
template <typename Measure>
uint32_t Farthest(size_t count, Measure&& measure) {
  uint32_t best = 0;
  double most = -1;
  for (uint32_t i = 0; i < count; ++i) {
    if (const double value = measure(i); value > most) {
      most = value;
      best = i;
    }
  }
  return best;
}

}  // namespace

VertexSubset::VertexSubset(std::span<const Vector> points) : points_(points) {
  HULLD_CHECK(!points.empty());
  Vector low = points[0];
  Vector high = points[0];
  for (const Vector& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // Quartered, so that no difference overflows.
  const Vector extent = high * 0.25 - low * 0.25;
  std::array<int, 3> exponents{};
  for (int k = 0; k < 3; ++k) std::frexp(extent[k], &exponents[k]);
  for (const Vector& p : points) {
    Vector moved = p * 0.25 - (low * 0.125 + high * 0.125);
    for (int k = 0; k < 3; ++k) moved[k] = std::ldexp(moved[k], -exponents[k]);
    scaled_.push_back(moved);
  }

  const size_t n = points.size();
  const uint32_t a = Farthest(n, [&](uint32_t i) { return -scaled_[i].x() + 2; });
  const uint32_t b = Farthest(n, [&](uint32_t i) { return (scaled_[i] - scaled_[a]).norm(); });
  const Vector ab = scaled_[b] - scaled_[a];
  const uint32_t c =
      Farthest(n, [&](uint32_t i) { return ab.cross(scaled_[i] - scaled_[a]).norm(); });
  const Vector normal = ab.cross(scaled_[c] - scaled_[a]);
  const uint32_t d =
      Farthest(n, [&](uint32_t i) { return std::abs(normal.dot(scaled_[i] - scaled_[a])); });
  for (const uint32_t i : {a, b, c, d}) {
    if (std::find(chosen_.begin(), chosen_.end(), i) == chosen_.end()) chosen_.push_back(i);
  }
  if (chosen_.size() < 4) {
    // Flat as far as rounding tells: both sides of a triangle, or of a segment.
    AddTriangle(a, b, c);
    AddTriangle(a, c, b);
  } else if (normal.dot(scaled_[d] - scaled_[a]) > 0) {
    AddTriangle(a, c, b);
    AddTriangle(a, b, d);
    AddTriangle(b, c, d);
    AddTriangle(c, a, d);
  } else {
    AddTriangle(a, b, c);
    AddTriangle(b, a, d);
    AddTriangle(c, b, d);
    AddTriangle(a, c, d);
  }
  for (uint32_t i = 0; i < n; ++i) {
    if (std::find(chosen_.begin(), chosen_.end(), i) == chosen_.end()) Assign(i, 0);
  }
}

void VertexSubset::AddTriangle(uint32_t a, uint32_t b, uint32_t c) {
  Triangle t;
  t.corners = {a, b, c};
  t.normal = (scaled_[b] - scaled_[a]).cross(scaled_[c] - scaled_[a]);
  const double length = t.normal.norm();
  if (length > 0) t.normal /= length;
  t.offset = t.normal.dot(scaled_[a]);
  triangles_.push_back(std::move(t));
}

double VertexSubset::HeightOf(const Triangle& triangle, uint32_t point) const {
  return triangle.normal.dot(scaled_[point]) - triangle.offset;
}

// Gives the point to the triangle, of those from `first_triangle` on, that it is nearest to.
void VertexSubset::Assign(uint32_t point, size_t first_triangle) {
  HULLD_CHECK(first_triangle < triangles_.size());
  size_t best = first_triangle;
  double least = INFINITY;
  for (size_t k = first_triangle; k < triangles_.size(); ++k) {
    if (const double distance = DistanceTo(triangles_[k], point); distance < least) {
      least = distance;
      best = k;
    }
  }
  Triangle& triangle = triangles_[best];
  if (triangle.near.empty() || least > triangle.distance) {
    triangle.distance = least;
    triangle.farthest = point;
  }
  triangle.near.push_back(point);
}

void VertexSubset::ChooseNext() {
  HULLD_CHECK(!is_complete());
  Triangle* worst = nullptr;
  for (Triangle& t : triangles_) {
    if (t.near.empty()) continue;
    if (worst == nullptr || t.distance > worst->distance) worst = &t;
  }
  // Each point that is not chosen is near some triangle.
  HULLD_CHECK(worst != nullptr);
  const uint32_t next = worst->farthest;
  chosen_.push_back(next);
  Forget(*worst, next);

  // The triangles that the point is above go; where rounding lets none be seen, the nearest.
  std::vector<char> goes;
  for (const Triangle& t : triangles_) goes.push_back(HeightOf(t, next) > 0);
  if (std::find(goes.begin(), goes.end(), 1) == goes.end()) goes[worst - triangles_.data()] = 1;

  std::vector<Triangle> kept;
  std::set<std::pair<uint32_t, uint32_t>> edges;
  std::vector<uint32_t> orphans;
  for (size_t k = 0; k < triangles_.size(); ++k) {
    Triangle& t = triangles_[k];
    if (!goes[k]) {
      kept.push_back(std::move(t));
      continue;
    }
    orphans.insert(orphans.end(), t.near.begin(), t.near.end());
    for (int i = 0; i < 3; ++i) {
      const std::pair<uint32_t, uint32_t> edge(t.corners[i], t.corners[(i + 1) % 3]);
      if (edges.erase({edge.second, edge.first}) == 0) edges.insert(edge);
    }
  }
  triangles_ = std::move(kept);
  const size_t first_new = triangles_.size();
  for (const auto& [tail, head] : edges) AddTriangle(tail, head, next);
  for (const uint32_t point : orphans) Assign(point, first_new);
}

void VertexSubset::Forget(Triangle& triangle, uint32_t point) {
  std::erase(triangle.near, point);
  triangle.distance = 0;
  for (const uint32_t other : triangle.near) {
    if (const double distance = DistanceTo(triangle, other); distance >= triangle.distance) {
      triangle.distance = distance;
      triangle.farthest = other;
    }
  }
}

double VertexSubset::DistanceBound() const {
  double bound = 0;
  for (const Triangle& t : triangles_) {
    if (!t.near.empty()) bound = std::max(bound, t.distance);
  }
  return bound;
}

double VertexSubset::DistanceTo(const Triangle& triangle, uint32_t point) const {
  const auto& [a, b, c] = triangle.corners;
  return DistanceToTriangleBound(points_[a], points_[b], points_[c], points_[point]);
}

}  // namespace hulld
