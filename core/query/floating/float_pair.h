#ifndef HULLD_CORE_QUERY_FLOATING_FLOAT_PAIR_H_
#define HULLD_CORE_QUERY_FLOATING_FLOAT_PAIR_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/terms/length_sum.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Storage for lists of candidates; without allocation for small hulls.
struct CandidateBuffer {
  static constexpr size_t kCapacity = 64;
  std::array<uint32_t, kCapacity> few;
  std::vector<uint32_t> many;
};

// A pair of placed hulls in floating point, with proven error bounds (core/numeric/error_bounds.h).
// All positions are relative to the world shifted by -t_A: A is only rotated, B is rotated and
// moved by t_B - t_A, so a common offset costs no accuracy.
class FloatPair {
 public:
  // The hulls must outlive the pair. Requires: both not empty.
  FloatPair(const PlacedHull& a, const PlacedHull& b)
      : a_(&a),
        b_(&b),
        offset_(PlainVector(b.X_WH().t) - a.X_WH().t),
        size_(a.query_hull().max_abs_coordinate() + b.query_hull().max_abs_coordinate() +
              LargestComponent(offset_)),
        usable_(IsFilterSize(size_)) {
    HULLD_DCHECK(!a.empty() && !b.empty());
    if (a.product() != nullptr || b.product() != nullptr) [[unlikely]] {
      TakeProducts();
    }
  }

  const PlacedHull& a() const { return *a_; }
  const PlacedHull& b() const { return *b_; }
  // True if the bounds below hold. False if the pair's size is outside [kFilterMinSize,
  // kFilterMaxSize], or if pieces of bodies are so far from the origins of their bodies, or of the
  // world, that the rounding of their poses is not small relative to the pair.
  bool usable() const { return usable_; }
  // The size S of the pair, the unit of the bounds.
  double size() const { return size_; }
  // t_B - t_A, rounded.
  const PlainVector& offset() const { return offset_; }

  // The exact sum of the radii of both hulls and a finite clearance. Everything else here describes
  // the cores.
  LengthSum RadiiPlus(double clearance) const {
    const std::array<double, 2>& a = a_->radii();
    const std::array<double, 2>& b = b_->radii();
    return LengthSum({a[0], a[1], b[0], b[1], clearance});
  }

  // A vertex of A - B far along a direction.
  struct Support {
    VertexPair pair;
    // n . (a - b): within SupportError of the maximum over A - B.
    double value;
  };
  // Returns the vertex of A farthest along n_W, and the vertex of B farthest against it.
  Support Farthest(const PlainVector& n_W) const;
  // Returns the error bound of that value relative to the true maximum. Requires: the largest
  // component of n_W between kDirectionMin and kDirectionMax.
  double SupportError(const PlainVector& n_W) const {
    const double largest = LargestComponent(n_W);
    HULLD_DCHECK(IsFilterDirection(largest));
    return kSupportErrorFactor * largest * size_;
  }

  // Returns all vertices of A that may be farthest along n_W, ascending, if each component of n_W
  // errs by up to `error`. The span refers to `buffer`.
  std::span<const uint32_t> CandidatesA(const Vector& n_W, double error,
                                        CandidateBuffer& buffer) const {
    return CandidatesOf(*a_, InA(n_W), TurnedError(n_W, error), Slack(n_W, error), buffer);
  }
  // Returns all vertices of B that may be farthest against n_W.
  std::span<const uint32_t> CandidatesB(const Vector& n_W, double error,
                                        CandidateBuffer& buffer) const {
    return CandidatesOf(*b_, -InB(n_W), TurnedError(n_W, error), Slack(n_W, error), buffer);
  }

  // Positions, each component within kMinkowskiErrorFactor * size().
  PlainVector PositionA(uint32_t i) const { return Rotated(*a_, i); }
  PlainVector PositionB(uint32_t i) const { return Rotated(*b_, i) + offset_; }
  // The vertex a - b of A - B, within the same bound.
  PlainVector Difference(VertexPair pair) const { return PositionA(pair.a) - PositionB(pair.b); }
  // A point of A - B, within the same bound.
  PlainVector CenterDifference() const {
    return PlainVector(a_->rotated_center()) - (PlainVector(b_->rotated_center()) + offset_);
  }
  // The hulls' bounds about their centers along n_W.
  class CenterView;
  CenterView ViewCenters(const PlainVector& n_W) const;
  // The difference of the means of the hulls' inner vertices, within the same bound.
  Vector InnerDifference() const { return InnerPoint(*a_) - (InnerPoint(*b_) + Vector(offset_)); }

 private:
  // Adds the rounding remainders of poses that are products to the offset.
  void TakeProducts();
  static Vector InnerPoint(const PlacedHull& placed);
  // Returns the greatest amount by which a candidate's value may be below the maximum. Products of
  // edges may be outside the range of directions. Even then nothing overflows, and the underflow,
  // 2^-1070, is far below the contribution of `error`, at least 2^-41 S^3.
  double Slack(const PlainVector& n_W, double error) const {
    return 2 * (kSupportErrorFactor * LargestComponent(n_W) * size_) +
           kDirectionErrorFactor * error * size_;
  }
  // Returns the error per component of n_W in a hull's own frame: errors of up to `error`, rotated,
  // plus rotation errors (see kSupportErrorFactor).
  static double TurnedError(const PlainVector& n_W, double error) {
    return 2 * error + 64 * kUnitRoundoff * LargestComponent(n_W);
  }
  static std::span<const uint32_t> CandidatesOf(const PlacedHull& placed, const PlainVector& n_own,
                                                double error, double slack,
                                                CandidateBuffer& buffer);
  static PlainVector Rotated(const PlacedHull& placed, uint32_t i) {
    return OutOfOwnFrame(placed, placed.query_hull().point(i));
  }
  static PlainVector OutOfOwnFrame(const PlacedHull& placed, const PlainVector& v) {
    const double* const R = placed.R_WH().data();  // column by column
    return {R[0] * v.x + R[3] * v.y + R[6] * v.z, R[1] * v.x + R[4] * v.y + R[7] * v.z,
            R[2] * v.x + R[5] * v.y + R[8] * v.z};
  }
  // Returns n_W in a hull's own frame.
  static PlainVector InOwnFrame(const PlacedHull& placed, const PlainVector& n_W) {
    const double* const R = placed.R_WH().data();
    return {R[0] * n_W.x + R[1] * n_W.y + R[2] * n_W.z, R[3] * n_W.x + R[4] * n_W.y + R[5] * n_W.z,
            R[6] * n_W.x + R[7] * n_W.y + R[8] * n_W.z};
  }
  PlainVector InA(const PlainVector& n_W) const { return InOwnFrame(*a_, n_W); }
  PlainVector InB(const PlainVector& n_W) const { return InOwnFrame(*b_, n_W); }

  const PlacedHull* a_;
  const PlacedHull* b_;
  PlainVector offset_;
  double size_;
  bool usable_;
};

class FloatPair::CenterView {
 public:
  // True if both hulls have bounds in this direction.
  bool known() const { return place_a_.known() && place_b_.known(); }
  CenterBounds::Bounds bounds_a() const { return pair_->a_->query_hull().BoundsAt(place_a_, n_a_); }
  CenterBounds::Bounds bounds_b() const { return pair_->b_->query_hull().BoundsAt(place_b_, n_b_); }
  // Approximate direction from A's surface to B's at the line of the centers; zero if unknown.
  PlainVector LikelyAxis() const {
    return OutOfOwnFrame(*pair_->a_, center_bounds_a().NormalAt(place_a_)) -
           OutOfOwnFrame(*pair_->b_, center_bounds_b().NormalAt(place_b_));
  }

 private:
  friend class FloatPair;
  CenterView(const FloatPair& pair, const PlainVector& n_W)
      : pair_(&pair),
        n_a_(pair.InA(n_W)),
        n_b_(-pair.InB(n_W)),
        place_a_(center_bounds_a().PlaceOf(n_a_)),
        place_b_(center_bounds_b().PlaceOf(n_b_)) {}

  const CenterBounds& center_bounds_a() const { return pair_->a_->query_hull().center_bounds(); }
  const CenterBounds& center_bounds_b() const { return pair_->b_->query_hull().center_bounds(); }

  const FloatPair* pair_;
  PlainVector n_a_;
  PlainVector n_b_;
  CenterBounds::Place place_a_;
  CenterBounds::Place place_b_;
};

inline FloatPair::CenterView FloatPair::ViewCenters(const PlainVector& n_W) const {
  return CenterView(*this, n_W);
}

// Inline, because every search step calls it. The values come from the support maps in the hulls'
// own frames, so that the bound on the maximum applies to them.
inline FloatPair::Support FloatPair::Farthest(const PlainVector& n_W) const {
  const SupportPoint a = a_->query_hull().Farthest(InA(n_W));
  const SupportPoint b = b_->query_hull().Farthest(-InB(n_W));
  return {{a.vertex, b.vertex}, a.value + b.value - Dot(n_W, offset_)};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FLOAT_PAIR_H_
