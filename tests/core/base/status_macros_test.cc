#include "core/base/status_macros.h"

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <gtest/gtest.h>

#include <memory>

namespace hulld {
namespace status_macros_test {

using Owned = std::unique_ptr<int>;

absl::StatusOr<Owned> Make(int number) {
  if (number < 0) return absl::OutOfRangeError("negative");
  return std::make_unique<int>(number);
}

absl::Status Check(int number) { return Make(number).status(); }

absl::StatusOr<int> Sum(int a, int b, int c) {
  HULLD_RETURN_IF_ERROR(Check(a));
  HULLD_ASSIGN_OR_RETURN(Owned sum, Make(a));
  const int first = *sum;
  HULLD_ASSIGN_OR_RETURN(sum, Make(b));
  HULLD_ASSIGN_OR_RETURN(const Owned last, Make(c));
  return first + *sum + *last;
}

TEST(StatusMacros, DeclareAndAssignValues) { EXPECT_EQ(*Sum(1, 20, 300), 321); }

TEST(StatusMacros, ReturnTheError) {
  EXPECT_TRUE(absl::IsOutOfRange(Sum(-1, 2, 3).status()));
  EXPECT_TRUE(absl::IsOutOfRange(Sum(1, -2, 3).status()));
  EXPECT_TRUE(absl::IsOutOfRange(Sum(1, 2, -3).status()));
}

}  // namespace status_macros_test
}  // namespace hulld
