#include "core/query/float_pair.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/numeric/error_bounds.h"

namespace hulld {
namespace {

// R(q) / |q|^2, within kRotationEntryError.
Eigen::Matrix3d RotationOf(const std::array<double, 4>& q) {
  double largest = 0;
  for (const double component : q) largest = std::max(largest, std::abs(component));
  int exponent = 0;
  std::frexp(largest, &exponent);
  const double w = std::ldexp(q[0], -exponent);
  const double x = std::ldexp(q[1], -exponent);
  const double y = std::ldexp(q[2], -exponent);
  const double z = std::ldexp(q[3], -exponent);
  const double norm = w * w + x * x + y * y + z * z;
  Eigen::Matrix3d R;
  R << w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
      w * w - x * x + y * y - z * z, 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
      w * w - x * x - y * y + z * z;
  return R / norm;
}

uint32_t Farthest(std::span<const Vector> vertices, const Vector& n) {
  uint32_t best = 0;
  double best_value = -INFINITY;
  for (uint32_t i = 0; i < vertices.size(); ++i) {
    const double value = vertices[i].dot(n);
    if (value > best_value) {
      best_value = value;
      best = i;
    }
  }
  return best;
}

std::vector<uint32_t> Candidates(std::span<const Vector> vertices, const Vector& n, double slack) {
  std::vector<double> values(vertices.size());
  for (size_t i = 0; i < vertices.size(); ++i) values[i] = vertices[i].dot(n);
  const double threshold = *std::max_element(values.begin(), values.end()) - slack;
  std::vector<uint32_t> candidates;
  for (uint32_t i = 0; i < values.size(); ++i) {
    if (values[i] >= threshold) candidates.push_back(i);
  }
  return candidates;
}

}  // namespace

FloatPair::FloatPair(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB)
    : a_(&a),
      b_(&b),
      R_WA_(RotationOf(X_WA.q)),
      R_WB_(RotationOf(X_WB.q)),
      offset_(X_WB.t - X_WA.t),
      size_(a.max_abs_coordinate() + b.max_abs_coordinate() + offset_.cwiseAbs().maxCoeff()),
      usable_(size_ >= kFilterMinSize && size_ <= kFilterMaxSize) {}

uint32_t FloatPair::FarthestA(const Vector& n_W) const {
  return Farthest(a_->vertices(), R_WA_.transpose() * n_W);
}

uint32_t FloatPair::FarthestB(const Vector& n_W) const {
  return Farthest(b_->vertices(), -(R_WB_.transpose() * n_W));
}

std::vector<uint32_t> FloatPair::CandidatesA(const Vector& n_W) const {
  return Candidates(a_->vertices(), R_WA_.transpose() * n_W, 2 * SupportError(n_W));
}

std::vector<uint32_t> FloatPair::CandidatesB(const Vector& n_W) const {
  return Candidates(b_->vertices(), -(R_WB_.transpose() * n_W), 2 * SupportError(n_W));
}

// Turned into each hull's frame as the maximum was, so that the bound on the maximum holds for it.
double FloatPair::Value(const Vector& n_W, uint32_t a, uint32_t b) const {
  const double value_A = a_->vertices()[a].dot(R_WA_.transpose() * n_W);
  const double value_B = b_->vertices()[b].dot(R_WB_.transpose() * n_W);
  return value_A - value_B - n_W.dot(offset_);
}

double FloatPair::SupportError(const Vector& n_W) const {
  return kSupportErrorFactor * n_W.cwiseAbs().maxCoeff() * size_;
}

}  // namespace hulld
