#ifndef HULLD_TESTS_CORE_CHECKS_SEPARATION_CHECK_H_
#define HULLD_TESTS_CORE_CHECKS_SEPARATION_CHECK_H_

#include <gtest/gtest.h>

#include <optional>

#include "core/query/collision.h"

namespace hulld {

// Queries separation, witness points, and clearances, and checks them against brute force in exact
// arithmetic independent of core. For hulls with at most about 50 differences.
class SeparationCheck {
 public:
  // True if the answer for (A, B) satisfies collision.h, and the answer for (B, A) mirrors it.
  testing::AssertionResult Verify(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB,
                                  std::optional<double> max_error = std::nullopt);

  int queries() const { return queries_; }
  int count(Relation relation) const { return relations_[static_cast<int>(relation)]; }
  // Number of separations with a bound that only exact arithmetic achieves, and with a larger
  // bound.
  int exact_count() const { return exact_; }
  int float_count() const { return float_; }

 private:
  int queries_ = 0;
  int relations_[4] = {};
  int exact_ = 0;
  int float_ = 0;
};

// Returns the options for everything that SeparationCheck queries.
QueryOptions WantSeparation(std::optional<double> max_error = std::nullopt);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_SEPARATION_CHECK_H_
