#include "core/query/floating/float_pair.h"

#include <algorithm>
#include <cmath>

namespace hulld {

FloatPair::Support FloatPair::CertainFarthest(const PlainVector& n_W, const Support& found) const {
  if (found.certain) return found;
  const double blur = kSupportBlurFactor * LargestComponent(n_W) * size_;
  const SupportMap::Support a =
      a_->query_hull().support().CertainFarthest(InA(n_W), blur, found.pair.a);
  const SupportMap::Support b =
      b_->query_hull().support().CertainFarthest(-InB(n_W), blur, found.pair.b);
  return {{a.vertex, b.vertex}, a.value + b.value - Dot(n_W, offset_), true};
}

std::span<const uint32_t> FloatPair::CandidatesOf(const PlacedHull& placed,
                                                  const PlainVector& n_own, double slack,
                                                  CandidateBuffer& buffer) {
  const std::span<const Vector> vertices = placed.hull().vertices();
  if (vertices.size() > CandidateBuffer::kMostFew) {
    buffer.many = placed.query_hull().support().Plateau(n_own, slack);
    return buffer.many;
  }
  // A small hull is scanned here, as a plateau needs an allocation.
  std::array<double, CandidateBuffer::kMostFew> values;
  double largest = -INFINITY;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vector& v = vertices[i];
    values[i] = (n_own.x * v.x() + n_own.y * v.y()) + n_own.z * v.z();
    largest = std::max(largest, values[i]);
  }
  const double least = largest - slack;
  size_t count = 0;
  for (size_t i = 0; i < vertices.size(); ++i) {
    buffer.few[count] = static_cast<uint32_t>(i);
    count += values[i] >= least ? 1 : 0;
  }
  return std::span(buffer.few).first(count);
}

Vector FloatPair::InnerPoint(const PlacedHull& placed) {
  const auto inner = placed.query_hull().inner_vertices();
  Vector sum = Vector::Zero();
  for (const uint32_t i : inner) sum += placed.hull().vertices()[i];
  return placed.R_WH() * (sum / static_cast<double>(inner.size()));
}

}  // namespace hulld
