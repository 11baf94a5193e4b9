// Tests of the history check for pairs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/history/made_up.h"

namespace hulld::server {
namespace pair_check_test {

using Kind = Operation::Kind;
using Outcome = Operation::Outcome;
using Operations = std::map<std::string, std::vector<Operation>>;

Operation PairAt(uint64_t invoked, uint64_t returned, uint64_t revision, uint64_t other) {
  Operation operation = Answered(Kind::kPair, invoked, returned, revision);
  operation.others = {{"b", other, other, "", other}};
  return operation;
}

// Hull a is replaced at ticks 21 to 22, b at 31 to 32.
Operations With(std::vector<Operation> pairs) {
  Operations operations = {{"a", {ReplaceAt(1, 2, 1, 1), ReplaceAt(21, 22, 2, 1)}},
                           {"b", {ReplaceAt(3, 4, 1, 1), ReplaceAt(31, 32, 2, 1)}}};
  auto& of_a = operations["a"];
  of_a.insert(of_a.end(), pairs.begin(), pairs.end());
  return operations;
}

TEST(PairCheck, AcceptsPairsThatCoexisted) {
  EXPECT_EQ(JointLinearizabilityFault(With({})), "");
  for (const auto& [a, b] : {std::pair<uint64_t, uint64_t>{1, 1}, {2, 1}, {2, 2}}) {
    EXPECT_EQ(JointLinearizabilityFault(With({PairAt(10, 40, a, b)})), "");
  }
}

// Each version existed during the call, but never both at the same time.
TEST(PairCheck, RefusesAPairThatNeverCoexisted) {
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(10, 40, 1, 2)})), "");
  // If both changes overlap, either may come first, but in the same order for all readers.
  Operations overlapping = With({});
  overlapping["a"][1].returned = 35;
  overlapping["a"].push_back(PairAt(10, 40, 1, 2));
  EXPECT_EQ(JointLinearizabilityFault(overlapping), "");
  overlapping["a"].push_back(PairAt(11, 41, 2, 1));
  EXPECT_NE(JointLinearizabilityFault(overlapping), "");
}

TEST(PairCheck, RefusesAPairFromThePastOrTheFuture) {
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(33, 34, 2, 1)})), "");
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(23, 24, 2, 2)})), "");
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(23, 24, 2, 1), PairAt(25, 26, 1, 1)})), "");
}

TEST(PairCheck, ExistingHullsAreNotReportedMissing) {
  Operation missing = PairAt(10, 40, 0, 0);
  missing.outcome = Outcome::kNotFound;
  EXPECT_NE(JointLinearizabilityFault(With({missing})), "");
  missing.invoked = 1;
  EXPECT_EQ(JointLinearizabilityFault(With({missing})), "");
}

}  // namespace pair_check_test
}  // namespace hulld::server
