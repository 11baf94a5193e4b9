#include "core/query/floating/float_pair.h"

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

std::vector<uint32_t> FloatPair::CandidatesA(const Vector& n_W, double error) const {
  return a_->query_hull().support().Plateau(InA(n_W), Slack(n_W, error));
}

std::vector<uint32_t> FloatPair::CandidatesB(const Vector& n_W, double error) const {
  return b_->query_hull().support().Plateau(-InB(n_W), Slack(n_W, error));
}

Vector FloatPair::InnerPoint(const PlacedHull& placed) {
  const auto inner = placed.query_hull().inner_vertices();
  Vector sum = Vector::Zero();
  for (const uint32_t i : inner) sum += placed.hull().vertices()[i];
  return placed.R_WH() * (sum / static_cast<double>(inner.size()));
}

}  // namespace hulld
