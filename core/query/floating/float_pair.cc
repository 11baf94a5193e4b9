#include "core/query/floating/float_pair.h"

#include <algorithm>
#include <cmath>

#include "core/numeric/expansion.h"

namespace hulld {

void FloatPair::TakeProducts() {
  Vector offset;
  double error = 0;
  double sizes = 0;
  for (int i = 0; i < 3; ++i) {
    const double t_A = a_->X_WH().t[i];
    const double t_B = b_->X_WH().t[i];
    const double rest_a = a_->product() == nullptr ? 0 : a_->product()->translation_rest()[i];
    const double rest_b = b_->product() == nullptr ? 0 : b_->product()->translation_rest()[i];
    const SumWithError difference = TwoSum(t_B, -t_A);
    offset[i] = difference.sum + (difference.error + (rest_b - rest_a));
    sizes = std::max(sizes, std::abs(t_A) + std::abs(t_B));
  }
  for (const PlacedHull* placed : {a_, b_}) {
    if (placed->product() != nullptr) error += placed->product()->translation_error();
  }
  offset_ = offset;
  size_ = a_->query_hull().max_abs_coordinate() + b_->query_hull().max_abs_coordinate() +
          LargestComponent(offset_);
  usable_ = IsFilterSize(size_) && error + kProductOffsetError * sizes <= kUnitRoundoff * size_;
}

std::span<const uint32_t> FloatPair::CandidatesOf(const PlacedHull& placed,
                                                  const PlainVector& n_own, double error,
                                                  double slack, CandidateBuffer& buffer) {
  const std::span<const Vector> vertices = placed.query_hull().points_together();
  if (vertices.empty() || vertices.size() > CandidateBuffer::kCapacity) {
    buffer.many = placed.query_hull().Candidates(n_own, error, slack);
    return buffer.many;
  }
  // Small hulls are scanned here because a list needs an allocation.
  std::array<double, CandidateBuffer::kCapacity> values;
  double largest = -INFINITY;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vector& v = vertices[i];
    values[i] = SupportValue(n_own, v.x(), v.y(), v.z());
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
  const auto inner = placed.query_hull().inner_points();
  Vector sum = Vector::Zero();
  for (const uint32_t i : inner) sum += placed.query_hull().point(i);
  // Avoids Eigen's product, which fuses products and sums where the processor can, with different
  // rounding.
  return OutOfOwnFrame(placed, Vector(sum / static_cast<double>(inner.size())));
}

}  // namespace hulld
