// What the check of histories says of pairs over two stores.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/history/made_up.h"

namespace hulld::server {
namespace {

using Kind = Operation::Kind;
using Outcome = Operation::Outcome;
using Operations = std::map<std::string, std::vector<Operation>>;

Operation PairAt(uint64_t invoked, uint64_t returned, uint64_t revision, uint64_t other) {
  Operation operation = Answered(Kind::kPair, invoked, returned, revision);
  operation.others = {{"b", other, other, "", other}};
  return operation;
}

// a is replaced at ticks 21 to 22, and b at 31 to 32.
Operations With(std::vector<Operation> pairs) {
  Operations operations = {{"a", {ReplaceAt(1, 2, 1, 1), ReplaceAt(21, 22, 2, 1)}},
                           {"b", {ReplaceAt(3, 4, 1, 1), ReplaceAt(31, 32, 2, 1)}}};
  auto& of_a = operations["a"];
  of_a.insert(of_a.end(), pairs.begin(), pairs.end());
  return operations;
}

TEST(PairCheck, AcceptsPairsThatWereThere) {
  EXPECT_EQ(JointLinearizabilityFault(With({})), "");
  for (const auto& [a, b] : {std::pair<uint64_t, uint64_t>{1, 1}, {2, 1}, {2, 2}}) {
    EXPECT_EQ(JointLinearizabilityFault(With({PairAt(10, 40, a, b)})), "");
  }
}

// Each of the two versions was there during the call, and never both.
TEST(PairCheck, RefusesAPairThatNeverWas) {
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(10, 40, 1, 2)})), "");
  // Where both changes overlap, either may have come first, but the same for all who read.
  Operations overlapping = With({});
  overlapping["a"][1].returned = 35;
  overlapping["a"].push_back(PairAt(10, 40, 1, 2));
  EXPECT_EQ(JointLinearizabilityFault(overlapping), "");
  overlapping["a"].push_back(PairAt(11, 41, 2, 1));
  EXPECT_NE(JointLinearizabilityFault(overlapping), "");
}

TEST(PairCheck, RefusesAPairOfThePastOrOfTheFuture) {
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(33, 34, 2, 1)})), "");
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(23, 24, 2, 2)})), "");
  EXPECT_NE(JointLinearizabilityFault(With({PairAt(23, 24, 2, 1), PairAt(25, 26, 1, 1)})), "");
}

TEST(PairCheck, NoHullIsSaidToBeMissingThatIsThere) {
  Operation missing = PairAt(10, 40, 0, 0);
  missing.outcome = Outcome::kNotFound;
  EXPECT_NE(JointLinearizabilityFault(With({missing})), "");
  missing.invoked = 1;
  EXPECT_EQ(JointLinearizabilityFault(With({missing})), "");
}

}  // namespace
}  // namespace hulld::server
