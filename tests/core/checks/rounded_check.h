#ifndef HULLD_TESTS_CORE_CHECKS_ROUNDED_CHECK_H_
#define HULLD_TESTS_CORE_CHECKS_ROUNDED_CHECK_H_

#include <gtest/gtest.h>

#include <array>

#include "core/hull/hull.h"
#include "core/query/collision.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/rung.h"

namespace hulld {

// A hull with a radius at a pose.
struct RoundedShape {
  Hull hull;
  Pose X_WH;
  double radius = 0;
};

// Returns core's answer for two rounded shapes.
absl::StatusOr<Answer> CheckRounded(const RoundedShape& a, const RoundedShape& b,
                                    const QueryOptions& options = {}, PairCache* cache = nullptr);

// Queries core about rounded shapes in all ways, and counts the regimes reached. For hulls with at
// most about 50 differences.
class RoundedCheck {
 public:
  // True if core's answers agree with brute force in exact arithmetic independent of core: the
  // relation for (A, B) and (B, A), alone, with a cache, and with details; separation, witness,
  // normal, certificate, and clearances.
  testing::AssertionResult Verify(const RoundedShape& a, const RoundedShape& b);

  int count(Relation relation) const { return relations_[static_cast<size_t>(relation)]; }
  // Number of answers for the relation alone from this rung.
  int count(Rung rung) const { return rungs_[static_cast<size_t>(rung)]; }
  // Number of pairs with cores that touch or overlap.
  int meeting_cores() const { return meeting_cores_; }

 private:
  std::array<int, 4> relations_ = {};
  std::array<int, kRungCount> rungs_ = {};
  int meeting_cores_ = 0;
};

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_ROUNDED_CHECK_H_
