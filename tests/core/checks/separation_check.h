#ifndef HULLD_TESTS_CORE_CHECKS_SEPARATION_CHECK_H_
#define HULLD_TESTS_CORE_CHECKS_SEPARATION_CHECK_H_

#include <gtest/gtest.h>

#include <optional>

#include "core/query/collision.h"

namespace hulld {

// Asks for separation, witness points and clearances, and checks them against brute force in exact
// arithmetic that shares nothing with core. For hulls with at most about 50 differences.
class SeparationCheck {
 public:
  // Whether the answer to A and B keeps every promise of collision.h, and that to B and A mirrors
  // it.
  testing::AssertionResult Ask(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB,
                               std::optional<double> max_error = std::nullopt);

  int questions() const { return questions_; }
  int count(Relation relation) const { return relations_[static_cast<int>(relation)]; }
  // How many separations came with a bound that only exact arithmetic reaches, and with another.
  int exact_count() const { return exact_; }
  int float_count() const { return float_; }

 private:
  int questions_ = 0;
  int relations_[4] = {};
  int exact_ = 0;
  int float_ = 0;
};

// The options for everything that SeparationCheck asks.
QueryOptions WantSeparation(std::optional<double> max_error = std::nullopt);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_SEPARATION_CHECK_H_
