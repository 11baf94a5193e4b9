#include "core/query/exact/exact_pair.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>

#include "core/numeric/exponent_limits.h"
#include "core/query/exact/exact_frame.h"
#include "core/query/exact/wide_pair.h"
#include "core/query/terms/pose.h"

namespace hulld {
namespace {

// The homogeneous matrix and squared norm of a quaternion as integers, up to common factors.
struct IntegerRotation {
  IntegerVector rows[3];
  Integer norm_squared;
};

IntegerRotation RotationOf(const Integer& w, const Integer& x, const Integer& y, const Integer& z) {
  const Integer ww = w * w;
  const Integer xx = x * x;
  const Integer yy = y * y;
  const Integer zz = z * z;
  const Integer wx = 2 * (w * x);
  const Integer wy = 2 * (w * y);
  const Integer wz = 2 * (w * z);
  const Integer xy = 2 * (x * y);
  const Integer xz = 2 * (x * z);
  const Integer yz = 2 * (y * z);
  return {{{ww + xx - yy - zz, xy - wz, xz + wy},
           {xy + wz, ww - xx + yy - zz, yz - wx},
           {xz - wy, yz + wx, ww - xx - yy + zz}},
          ww + xx + yy + zz};
}

IntegerRotation RotationOf(const std::array<double, 4>& q) {
  if (SmallRotation small; FindSmallRotation(q, small)) {
    IntegerRotation rotation;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rotation.rows[i][j] = ToInteger(WideOf(small.rows[i][j]));
    }
    rotation.norm_squared = ToInteger(WideOf(small.norm));
    return rotation;
  }
  int exponent = kAboveAllExponents;
  for (const double component : q) {
    if (component != 0) exponent = std::min(exponent, LowestBitExponent(component));
  }
  return RotationOf(ToInteger(q[0], exponent), ToInteger(q[1], exponent), ToInteger(q[2], exponent),
                    ToInteger(q[3], exponent));
}

// Returns the rotation of a motion at a time.
IntegerRotation RotationAt(const Motion& motion, double time) {
  if (IsTranslation(motion)) return RotationOf(motion.start.q);
  const std::array<Integer, 4> q = QuaternionAt(motion, time);
  return RotationOf(q[0], q[1], q[2], q[3]);
}

// Returns the rotation of the outer pose of a product.
IntegerRotation OuterRotation(const PoseProduct& product) {
  return product.motion() == nullptr ? RotationOf(product.X_WB().q)
                                     : RotationAt(*product.motion(), product.time());
}

// Returns the translation of the outer pose of a product over 2^exponent.
IntegerVector OuterTranslation(const PoseProduct& product, int exponent) {
  if (product.motion() == nullptr) return ToInteger(product.X_WB().t, exponent);
  return TranslationAt(*product.motion(), product.time(), exponent);
}

IntegerRotation RotationOf(const PlacedHull& placed) {
  if (placed.product() == nullptr) return RotationOf(placed.X_WH().q);
  const IntegerRotation outer = OuterRotation(*placed.product());
  const IntegerRotation inner = RotationOf(placed.product()->X_BP().q);
  IntegerRotation product;
  for (int i = 0; i < 3; ++i) {
    product.rows[i] = outer.rows[i].x * inner.rows[0] + outer.rows[i].y * inner.rows[1] +
                      outer.rows[i].z * inner.rows[2];
  }
  product.norm_squared = outer.norm_squared * inner.norm_squared;
  return product;
}

// Returns the norm of the rotation times the translation over 2^exponent. The results are integers:
// the translation of a piece of a body, R(q_B) t_P / |q_B|^2 + t_B, has a divisor of that norm as
// its denominator.
IntegerVector ScaledTranslation(const PlacedHull& placed, const Integer& norm, int exponent) {
  const PoseProduct* const product = placed.product();
  if (product == nullptr) return norm * ToInteger(placed.X_WH().t, exponent);
  const IntegerRotation body = OuterRotation(*product);
  const IntegerVector t_P = ToInteger(product->X_BP().t, exponent);
  const IntegerVector turned = {Dot(body.rows[0], t_P), Dot(body.rows[1], t_P),
                                Dot(body.rows[2], t_P)};
  return (norm / body.norm_squared) * turned + norm * OuterTranslation(*product, exponent);
}

}  // namespace

// Each function returns the farthest candidates, ascending; none if the direction is too wide.
class ExactPair::Narrow {
 public:
  virtual ~Narrow() = default;
  virtual std::vector<uint32_t> FeatureA(const IntegerVector& n,
                                         std::span<const uint32_t> candidates,
                                         ScanPoll& poll) const = 0;
  virtual std::vector<uint32_t> FeatureB(const IntegerVector& n,
                                         std::span<const uint32_t> candidates,
                                         ScanPoll& poll) const = 0;
  virtual size_t MemoryBytes() const = 0;
};

template <int kWords>
class ExactPair::NarrowOf : public Narrow {
 public:
  NarrowOf(const FloatPair& filter, const SmallFrame& frame) : pair_(filter, frame, kNever) {}

  std::vector<uint32_t> FeatureA(const IntegerVector& n, std::span<const uint32_t> candidates,
                                 ScanPoll& poll) const override {
    typename WidePair<kWords>::Direction wide;
    if (!ToWide(n, wide)) return {};
    return pair_.FeatureA(wide, candidates, poll);
  }
  std::vector<uint32_t> FeatureB(const IntegerVector& n, std::span<const uint32_t> candidates,
                                 ScanPoll& poll) const override {
    typename WidePair<kWords>::Direction wide;
    if (!ToWide(n, wide)) return {};
    return pair_.FeatureB(wide, candidates, poll);
  }
  size_t MemoryBytes() const override { return sizeof(*this); }

  static std::unique_ptr<Narrow> Make(const FloatPair& filter, const SmallFrame& frame) {
    if (!WidePair<kWords>::Fits(frame)) return nullptr;
    return std::make_unique<NarrowOf>(filter, frame);
  }

 private:
  // The scans of this class poll through the argument that they receive.
  static inline const std::function<bool()> kNever;

  WidePair<kWords> pair_;
};

ExactPair::~ExactPair() = default;

ExactPair::ExactPair(const FloatPair& filter, const std::function<bool()>& should_stop,
                     bool with_narrow)
    : filter_(&filter), poll_(should_stop) {
  const IntegerRotation R_A = RotationOf(filter.a());
  const IntegerRotation R_B = RotationOf(filter.b());
  a_ = {&filter.a().query_hull(), {}, {}, {}};
  b_ = {&filter.b().query_hull(), {}, {}, {}};
  const int exponent_a = a_.hull->exponent();
  const int exponent_b = b_.hull->exponent();
  const int shift_exponent =
      TranslationExponent(filter.a(), TranslationExponent(filter.b(), kAboveAllExponents));
  const int common = std::min({exponent_a, exponent_b, shift_exponent});
  // A common norm is multiplied in only once.
  const bool same_norm = R_A.norm_squared == R_B.norm_squared;
  const Integer factor_a = same_norm ? Integer(1) : R_B.norm_squared;
  const Integer factor_b = same_norm ? Integer(1) : R_A.norm_squared;
  for (int i = 0; i < 3; ++i) {
    a_.rows[i] = (factor_a << (exponent_a - common)) * R_A.rows[i];
    b_.rows[i] = (factor_b << (exponent_b - common)) * R_B.rows[i];
  }
  exponent_ = common;
  norm_ = factor_a * R_A.norm_squared;
  a_.shift = {0, 0, 0};
  b_.shift = ScaledTranslation(filter.b(), norm_, common) - TranslationA();

  SmallFrame frame;
  if (!with_narrow || !FindSmallFrame(filter, frame)) return;
  narrow_ = NarrowOf<1>::Make(filter, frame);
  if (narrow_ == nullptr) narrow_ = NarrowOf<2>::Make(filter, frame);
  if (narrow_ == nullptr) narrow_ = NarrowOf<3>::Make(filter, frame);
  if (narrow_ == nullptr) narrow_ = NarrowOf<5>::Make(filter, frame);
}

IntegerVector ExactPair::TranslationA() const {
  return ScaledTranslation(filter_->a(), norm_, exponent_);
}

IntegerVector ExactPair::ToWorld(const Side& side, const IntegerVector& own) {
  return {Dot(side.rows[0], own), Dot(side.rows[1], own), Dot(side.rows[2], own)};
}

const IntegerVector& ExactPair::Vertex(Side& side, uint32_t i) {
  if (const auto found = side.vertices.find(i); found != side.vertices.end()) return found->second;
  const IntegerVector own = ToInteger(side.hull->point(i), side.hull->exponent());
  return side.vertices.emplace(i, ToWorld(side, own) + side.shift).first->second;
}

void ExactPair::CacheAllVertices() {
  for (uint32_t i = 0; i < a().point_count() && !poll_.StopsAfter(i + 1); ++i) VertexA(i);
  for (uint32_t i = 0; i < b().point_count() && !poll_.StopsAfter(i + 1); ++i) VertexB(i);
}

size_t ExactPair::MemoryBytes() const {
  size_t bytes = narrow_ == nullptr ? 0 : narrow_->MemoryBytes();
  for (const Side* const side : {&a_, &b_}) {
    // A map node has a pointer in addition to the value, and a bucket is a pointer.
    bytes += side->vertices.size() * (sizeof(*side->vertices.begin()) + sizeof(void*)) +
             side->vertices.bucket_count() * sizeof(void*);
  }
  return bytes;
}

std::vector<uint32_t> ExactPair::AllOf(const Side& side) const {
  std::vector<uint32_t> all(side.hull->point_count());
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

// Compares along n in the hull's own frame, which needs less computation and no storage.
std::vector<uint32_t> ExactPair::Farthest(const Side& side, std::span<const uint32_t> candidates,
                                          const IntegerVector& n) {
  if (candidates.size() == 1) return {candidates[0]};
  const IntegerVector n_own = n.x * side.rows[0] + n.y * side.rows[1] + n.z * side.rows[2];
  std::vector<uint32_t> farthest;
  size_t seen = 0;
  Integer best;
  for (const uint32_t i : candidates) {
    if (poll_.StopsAfter(++seen)) break;
    const Integer value = Dot(n_own, ToInteger(side.hull->point(i), side.hull->exponent()));
    if (!farthest.empty() && value < best) continue;
    if (farthest.empty() || value > best) {
      farthest.clear();
      best = value;
    }
    farthest.push_back(i);
  }
  return farthest;
}

std::vector<uint32_t> ExactPair::FeatureA(const IntegerVector& n,
                                          std::span<const uint32_t> candidates) {
  if (narrow_ != nullptr && candidates.size() > 1) {
    std::vector<uint32_t> feature = narrow_->FeatureA(n, candidates, poll_);
    if (!feature.empty()) return feature;
  }
  return Farthest(a_, candidates, n);
}

std::vector<uint32_t> ExactPair::FeatureB(const IntegerVector& n,
                                          std::span<const uint32_t> candidates) {
  if (narrow_ != nullptr && candidates.size() > 1) {
    std::vector<uint32_t> feature = narrow_->FeatureB(n, candidates, poll_);
    if (!feature.empty()) return feature;
  }
  return Farthest(b_, candidates, -n);
}

std::vector<uint32_t> ExactPair::FeatureA(const IntegerVector& n) {
  if (!filter_->usable() || IsZero(n)) return FeatureA(n, AllOf(a_));
  const Vector n_W = ToScaledDoubles(n);
  CandidateBuffer buffer;
  return FeatureA(n,
                  filter_->CandidatesA(n_W, kScaledDoublesError * LargestComponent(n_W), buffer));
}

std::vector<uint32_t> ExactPair::FeatureB(const IntegerVector& n) {
  if (!filter_->usable() || IsZero(n)) return FeatureB(n, AllOf(b_));
  const Vector n_W = ToScaledDoubles(n);
  CandidateBuffer buffer;
  return FeatureB(n,
                  filter_->CandidatesB(n_W, kScaledDoublesError * LargestComponent(n_W), buffer));
}

IntegerVector ExactPair::SumOfInnerVertices(const Side& side) {
  IntegerVector own = {0, 0, 0};
  for (const uint32_t i : side.hull->inner_points()) {
    own = own + ToInteger(side.hull->point(i), side.hull->exponent());
  }
  return ToWorld(side, own) + Integer(side.hull->inner_points().size()) * side.shift;
}

IntegerVector ExactPair::CenterDifference() const {
  return Integer(b_.hull->inner_points().size()) * SumOfInnerVertices(a_) -
         Integer(a_.hull->inner_points().size()) * SumOfInnerVertices(b_);
}

}  // namespace hulld
