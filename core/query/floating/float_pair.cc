#include "core/query/floating/float_pair.h"

namespace hulld {

std::vector<uint32_t> FloatPair::CandidatesA(const Vector& n_W, double error) const {
  return a_->query_hull().Candidates(InA(n_W), TurnedError(n_W, error), Slack(n_W, error));
}

std::vector<uint32_t> FloatPair::CandidatesB(const Vector& n_W, double error) const {
  return b_->query_hull().Candidates(-InB(n_W), TurnedError(n_W, error), Slack(n_W, error));
}

Vector FloatPair::InnerPoint(const PlacedHull& placed) {
  const auto inner = placed.query_hull().inner_points();
  Vector sum = Vector::Zero();
  for (const uint32_t i : inner) sum += placed.query_hull().point(i);
  return placed.R_WH() * (sum / static_cast<double>(inner.size()));
}

}  // namespace hulld
