#include "core/query/floating/float_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/simd_path.h"
#include "core/query/floating/nearest_part.h"
#include "core/query/floating/small_pair.h"
#include "core/query/terms/minkowski_vertex.h"

namespace hulld {
namespace {

// Step limit. More steps occur only if rounding hinders the walk. Observed: random pairs of up to
// 10000 vertices need fewer than 40.
constexpr int kMaxSteps = 128;

using Corner = MinkowskiVertex<PlainVector>;

// Lower bound on the distance from the support along a unit vector.
template <typename Pair>
double LowOf(const Pair& pair, double value) {
  return -value - kReachErrorFactor * pair.size();
}

// The corners of the part of A - B that is nearest to the origin so far. Pair: a FloatPair or a
// SmallPair.
template <typename Pair>
class Walk {
 public:
  Walk(const Pair& pair, const SeparationGoal& goal)
      : pair_(pair), goal_(goal), unit_(UnitOf(pair.size())), per_unit_(1 / unit_) {}

  SeparationBounds Run(const PlainVector& first, std::span<const VertexPair> start) {
    const double largest = LargestComponent(first);
    PlainVector n = {first.x / largest, first.y / largest, first.z / largest};
    if (!start.empty()) {
      for (const VertexPair& known : start) Add(known);
      if (const NearestPart part = Nearest(); Accept(part)) n = part.toward;
    }
    for (int step = 0; step < kMaxSteps; ++step) {
      const double length = Norm(n);
      if (!(length > 0)) break;
      n = (1 / length) * n;
      const FloatPair::Support farthest = pair_.Farthest(n);
      if (const double low = LowOf(pair_, farthest.value); low > bounds_.low) {
        bounds_.low = low;
        bounds_.direction = n;
      }
      if (goal_.Met(bounds_.low, bounds_.high) || Contains(farthest.pair)) break;
      Add(farthest.pair);
      const NearestPart part = Nearest();
      // In exact arithmetic every step comes nearer.
      if (!Accept(part)) break;
      n = part.toward;
      if (goal_.Met(bounds_.low, bounds_.high)) break;
    }
    bounds_.low = std::min(bounds_.low, bounds_.high);
    return bounds_;
  }

 private:
  void Add(VertexPair pair) { corners_[count_++] = {per_unit_ * pair_.Difference(pair), pair}; }

  bool Contains(VertexPair pair) const {
    return std::any_of(corners_.begin(), corners_.begin() + count_,
                       [&](const Corner& corner) { return corner.pair == pair; });
  }

  NearestPart OnFace(uint8_t i, uint8_t j, uint8_t k) const {
    NearestPart part = NearestOnTriangle(corners_[i].w, corners_[j].w, corners_[k].w);
    const uint8_t corners[3] = {i, j, k};
    for (uint32_t c = 0; c < part.count; ++c) part.corners[c] = corners[part.corners[c]];
    return part;
  }

  NearestPart Nearest() const {
    if (count_ == 1) return NearestOfVertex(corners_[0].w);
    if (count_ == 2) return NearestOnEdge(corners_[0].w, corners_[1].w, 0, 1);
    if (count_ == 3) return OnFace(0, 1, 2);
    // The nearest part includes the newest corner. A face away from the origin is never nearer than
    // a face toward it.
    NearestPart best = OnFace(3, 0, 1);
    double least = SquaredNorm(best.point);
    for (const NearestPart& part : {OnFace(3, 1, 2), OnFace(3, 2, 0)}) {
      const double squared = SquaredNorm(part.point);
      if (squared < least) {
        least = squared;
        best = part;
      }
    }
    return best;
  }

  // Keeps the part. Returns false if it is not nearer than the last.
  bool Accept(const NearestPart& part) {
    const double length = Norm(part.point);
    if (!(length < nearest_)) return false;
    nearest_ = length;
    std::array<Corner, 4> kept;
    for (uint32_t i = 0; i < part.count; ++i) kept[i] = corners_[part.corners[i]];
    corners_ = kept;
    count_ = part.count;
    bounds_.point_length = length * unit_;
    bounds_.high = bounds_.point_length + kCombinationErrorFactor * pair_.size();
    bounds_.point.count = count_;
    for (uint32_t i = 0; i < count_; ++i) {
      bounds_.point.pairs[i] = corners_[i].pair;
      bounds_.point.weights[i] = part.weights[i];
    }
    return true;
  }

  const Pair& pair_;
  const SeparationGoal& goal_;
  const double unit_;
  const double per_unit_;
  std::array<Corner, 4> corners_;
  uint32_t count_ = 0;
  double nearest_ = INFINITY;
  SeparationBounds bounds_;
};

template <uint32_t kMaxVertices>
SeparationBounds WalkSmallPortably(const FloatPair& pair, const PlainVector& n,
                                   std::span<const VertexPair> start, const SeparationGoal& goal) {
  const SmallPair<kMaxVertices> small(pair);
  return Walk(small, goal).Run(n, start);
}

#ifdef HULLD_HAS_AVX2_PATH
// The entire call tree is compiled for AVX2, so that lanes stay in registers.
template <uint32_t kMaxVertices>
__attribute__((target("avx2"), flatten)) SeparationBounds WalkSmallAvx2(
    const FloatPair& pair, const PlainVector& n, std::span<const VertexPair> start,
    const SeparationGoal& goal) {
  const SmallPair<kMaxVertices> small(pair);
  return Walk(small, goal).Run(n, start);
}
#else
template <uint32_t kMaxVertices>
SeparationBounds WalkSmallAvx2(const FloatPair& pair, const PlainVector& n,
                               std::span<const VertexPair> start, const SeparationGoal& goal) {
  return WalkSmallPortably<kMaxVertices>(pair, n, start, goal);
}
#endif

template <uint32_t kMaxVertices>
SeparationBounds WalkSmall(const FloatPair& pair, const PlainVector& n,
                           std::span<const VertexPair> start, const SeparationGoal& goal) {
  return UsesAvx2() ? WalkSmallAvx2<kMaxVertices>(pair, n, start, goal)
                    : WalkSmallPortably<kMaxVertices>(pair, n, start, goal);
}

// Returns the weights of the corners of a simplex in its point nearest to the origin, if that point
// is inside the simplex; otherwise in some point of the simplex. The weights are not negative, and
// their sum is within 8 u of 1. NaN if rounding leaves no positive weight. count: the number of
// corners, 1 to 3; the other arguments are not used.
std::array<double, 3> WeightsInside(const PlainVector& p, const PlainVector& q,
                                    const PlainVector& r, size_t count) {
  if (count == 1) return {1, 0, 0};
  const PlainVector e = q - p;
  double of_p = Dot(e, q);
  double of_q = -Dot(e, p);
  double of_r = 0;
  if (count == 3) {
    const PlainVector f = r - p;
    const PlainVector n = Cross(e, f);
    of_p = Dot(Cross(q, r - q), n);
    of_q = Dot(Cross(f, p), n);
    of_r = Dot(Cross(p, e), n);
  }
  of_p = std::max(of_p, 0.0);
  of_q = std::max(of_q, 0.0);
  of_r = std::max(of_r, 0.0);
  const double scale = 1 / (of_p + of_q + of_r);
  return {scale * of_p, scale * of_q, scale * of_r};
}

// Bounds the distance by the result of a search: from below by the reach of A - B along n, from
// above by the nearest point of the simplex. The length of n and the quotient err by 4 u of
// themselves in total, less than kReachErrorFactor allows for the length of a unit vector.
// Requires: `simplex` is not empty.
SeparationBounds BoundsAtEnd(const FloatPair& pair, const PlainVector& n, double reach,
                             std::span<const VertexPair> simplex) {
  SeparationBounds bounds;
  bounds.point.count = static_cast<uint32_t>(simplex.size());
  // Without loops, so that the corners stay in registers. Repeats the last corner.
  const VertexPair first = simplex[0];
  const VertexPair second = simplex[simplex.size() > 1 ? 1 : 0];
  const VertexPair third = simplex.back();
  bounds.point.pairs = {first, second, third};
  // In units near the size.
  const double unit = UnitOf(pair.size());
  const double per_unit = 1 / unit;
  const PlainVector p = per_unit * pair.Difference(first);
  const PlainVector q = per_unit * pair.Difference(second);
  const PlainVector r = per_unit * pair.Difference(third);
  const std::array<double, 3> weights = WeightsInside(p, q, r, simplex.size());
  bounds.point.weights = weights;
  bounds.point_length = Norm((weights[0] * p + weights[1] * q) + weights[2] * r) * unit;
  bounds.high = bounds.point_length + kCombinationErrorFactor * pair.size();
  const double length = Norm(n);
  bounds.low = std::min(LowOf(pair, reach / length), bounds.high);
  bounds.direction = PlainVector(n.x / length, n.y / length, n.z / length);
  return bounds;
}

}  // namespace

SeparationBounds BoundDistance(const FloatPair& pair, const Vector& n,
                               std::span<const VertexPair> start, const SeparationGoal& goal,
                               double reach) {
  HULLD_CHECK(pair.usable());
  HULLD_CHECK(start.size() <= 3);
  if (reach < INFINITY && !start.empty()) {
    const SeparationBounds bounds = BoundsAtEnd(pair, n, reach, start);
    // Without a point, `high` is NaN.
    if (bounds.high < INFINITY && goal.Met(bounds.low, bounds.high)) return bounds;
  }
  if (SmallPair<8>::Fits(pair)) return WalkSmall<8>(pair, n, start, goal);
  if (SmallPair<16>::Fits(pair)) return WalkSmall<16>(pair, n, start, goal);
  return Walk(pair, goal).Run(n, start);
}

double DistanceAlong(const FloatPair& pair, const Vector& n) {
  const Vector scaled = n / n.cwiseAbs().maxCoeff();
  return LowOf(pair, pair.Farthest(Vector(scaled / scaled.norm())).value);
}

double DistanceOfTriangle(const FloatPair& pair, const VertexPair* pairs) {
  const double unit = UnitOf(pair.size());
  const auto corner = [&](int i) { return 1 / unit * pair.Difference(pairs[i]); };
  const NearestPart nearest = NearestOnTriangle(corner(0), corner(1), corner(2));
  return Norm(nearest.point) * unit + kCombinationErrorFactor * pair.size();
}

Vector TowardOrigin(const FloatPair& pair, const SeparationBounds& bounds) {
  Vector to_origin = Vector::Zero();
  for (uint32_t i = 0; i < bounds.point.count; ++i) {
    to_origin -= Vector(bounds.point.weights[i] * pair.Difference(bounds.point.pairs[i]));
  }
  return to_origin / UnitOf(pair.size());
}

}  // namespace hulld
