#ifndef HULLD_CORE_QUERY_FLOAT_PAIR_H_
#define HULLD_CORE_QUERY_FLOAT_PAIR_H_

#include <cstdint>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/pose.h"

namespace hulld {

// A pair of posed hulls in floating point, with proven error bounds (core/numeric/error_bounds.h).
// Everything is relative to the world shifted by -t_A: A is rotated only, B is rotated and moved by
// t_B - t_A, so a common offset costs no accuracy.
class FloatPair {
 public:
  FloatPair(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB);

  // Whether the bounds below hold: false when the pair's size is beyond [kFilterMinSize,
  // kFilterMaxSize].
  bool usable() const { return usable_; }
  // The size S of the pair that the bounds are relative to.
  double size() const { return size_; }

  // The vertex of A farthest along n_W, and of B farthest against it; the lowest index among
  // equals.
  uint32_t FarthestA(const Vector& n_W) const;
  uint32_t FarthestB(const Vector& n_W) const;
  // All vertices of A that may be farthest along n_W when each component of n_W errs by up to 64 u
  // of the largest.
  std::vector<uint32_t> CandidatesA(const Vector& n_W) const;
  // All vertices of B that may be farthest against n_W.
  std::vector<uint32_t> CandidatesB(const Vector& n_W) const;

  // Positions, each component within kMinkowskiErrorFactor * size().
  Vector PositionA(uint32_t i) const { return R_WA_ * a_->vertices()[i]; }
  Vector PositionB(uint32_t i) const { return R_WB_ * b_->vertices()[i] + offset_; }
  // A point of A - B, within the same bound.
  Vector CenterDifference() const {
    return R_WA_ * a_->center() - (R_WB_ * b_->center() + offset_);
  }
  // n . w for the Minkowski vertex of a and b.
  double Value(const Vector& n_W, uint32_t a, uint32_t b) const;
  // How far Value, at its maximum over all vertices, may be from the true maximum.
  double SupportError(const Vector& n_W) const;

 private:
  const Hull* a_;
  const Hull* b_;
  Eigen::Matrix3d R_WA_;
  Eigen::Matrix3d R_WB_;
  Vector offset_;
  double size_;
  bool usable_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOAT_PAIR_H_
