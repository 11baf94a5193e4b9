// Tests of the history check for answers about several hulls and bodies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/history/made_up.h"

namespace hulld::server {
namespace batch_check_test {

using ::testing::HasSubstr;
using Kind = Operation::Kind;
using Operations = std::map<std::string, std::vector<Operation>>;

Seen SeenAt(const std::string& hull_id, uint64_t revision) {
  return {hull_id, revision, revision, "", revision};
}

Seen Missing(const std::string& hull_id, const std::string& piece = "") {
  Seen seen{.hull_id = hull_id};
  seen.is_missing = piece.empty();
  seen.missing_piece = piece;
  return seen;
}

Operation BatchAt(uint64_t invoked, uint64_t returned, std::vector<Seen> all) {
  Operation operation = Answered(Kind::kBatch, invoked, returned, 0);
  operation.others = std::move(all);
  return operation;
}

// Hulls a and c have one point each. At ticks 21 to 22 a gets another point, at 31 to 32 c does.
// The body b has both as pieces since tick 6. Each has its own store, so revisions start at 1.
Operations With(const std::vector<Operation>& of_a) {
  Operation put = Answered(Kind::kPut, 5, 6, 1);
  put.created = true;
  put.pieces = {"a", "c"};
  Operations operations = {{"a", {ReplaceAt(1, 2, 1, 0x1), ReplaceAt(21, 22, 2, 0x2)}},
                           {"b", {put}},
                           {"c", {ReplaceAt(3, 4, 1, 0x4), ReplaceAt(31, 32, 2, 0x8)}}};
  for (auto& [id, of_id] : operations) {
    for (Operation& operation : of_id) operation.store_id = id;
  }
  auto& all = operations["a"];
  all.insert(all.end(), of_a.begin(), of_a.end());
  return operations;
}
std::string FaultOf(const std::vector<Operation>& of_a) {
  return JointLinearizabilityFault(With(of_a));
}
std::string FaultOfBatch(uint64_t invoked, uint64_t returned, std::vector<Seen> all) {
  return FaultOf({BatchAt(invoked, returned, std::move(all))});
}

TEST(BatchCheck, AcceptsStatesFromOneInstant) {
  EXPECT_EQ(FaultOfBatch(10, 40, {SeenAt("a", 1), SeenAt("b", 1), SeenAt("c", 1)}), "");
  EXPECT_EQ(FaultOfBatch(10, 40, {SeenAt("a", 2), SeenAt("b", 1), SeenAt("c", 1)}), "");
  EXPECT_EQ(FaultOfBatch(10, 40, {SeenAt("a", 2), SeenAt("b", 1), SeenAt("c", 2)}), "");
  EXPECT_EQ(FaultOfBatch(1, 40, {Missing("b"), SeenAt("c", 1)}), "");
}

// Each version existed during the call, but never both at the same time.
TEST(BatchCheck, RefusesHullsThatNeverCoexisted) {
  EXPECT_NE(FaultOfBatch(10, 40, {SeenAt("a", 1), SeenAt("b", 1), SeenAt("c", 2)}), "");
  EXPECT_NE(FaultOfBatch(1, 40, {Missing("b"), SeenAt("a", 2)}), "");
  EXPECT_NE(FaultOfBatch(1, 40, {Missing("a"), SeenAt("c", 1)}), "");
}

TEST(BatchCheck, RefusesEarlierAndLaterStates) {
  EXPECT_NE(FaultOfBatch(33, 34, {SeenAt("a", 2), SeenAt("c", 1)}), "");
  EXPECT_NE(FaultOfBatch(10, 11, {SeenAt("a", 2), SeenAt("c", 1)}), "");
  EXPECT_NE(FaultOfBatch(33, 34, {Missing("b")}), "");
}

TEST(BatchCheck, RefusesARelationThatContradictsThePoints) {
  for (const PointSet touched : {0x0, 0x1, 0x2, 0x3}) {
    Seen seen = SeenAt("a", 1);
    seen.probed = 0x3;
    seen.touched = touched;
    EXPECT_EQ(FaultOfBatch(10, 40, {seen}).empty(), touched == 0x1);
  }
  // A body touches everything that one of its pieces touches.
  for (const PointSet touched : {0x1, 0x4, 0x5, 0x6}) {
    Seen seen = SeenAt("b", 1);
    seen.probed = 0xf;
    seen.touched = touched;
    EXPECT_EQ(FaultOfBatch(10, 40, {seen}).empty(), touched == 0x5 || touched == 0x6);
    EXPECT_EQ(FaultOfBatch(10, 40, {seen, SeenAt("a", 1)}).empty(), touched == 0x5);
  }
}

TEST(BatchCheck, RefusesAWrongSize) {
  for (const uint64_t size : {0, 1, 2}) {
    Seen hull = SeenAt("a", 1);
    hull.size = size;
    EXPECT_EQ(FaultOfBatch(10, 40, {hull}).empty(), size == 1);
    Seen body = SeenAt("b", 1);
    body.size = size;
    EXPECT_EQ(FaultOfBatch(10, 40, {body}).empty(), size == 2);
  }
}

TEST(BatchCheck, RefusesThatAnAnswerIsMissing) {
  Seen seen = SeenAt("a", 1);
  seen.lacks_answer = true;
  EXPECT_NE(FaultOfBatch(10, 40, {seen}), "");
}

TEST(BatchCheck, APieceCanBeMissingOnlyIfTheBodyContainsIt) {
  EXPECT_NE(FaultOfBatch(10, 40, {Missing("b", "c")}), "");
  Operation gone = Answered(Kind::kDelete, 35, 36, 3);
  gone.store_id = "c";
  const auto fault_of = [&](const std::vector<Seen>& all) {
    Operations operations = With({BatchAt(33, 40, all)});
    operations["c"].push_back(gone);
    return JointLinearizabilityFault(operations);
  };
  EXPECT_EQ(fault_of({Missing("b", "c")}), "");
  EXPECT_EQ(fault_of({Missing("b", "c"), Missing("c")}), "");
  EXPECT_NE(fault_of({Missing("b", "c"), SeenAt("c", 2)}), "");
  EXPECT_NE(fault_of({Missing("b", "a")}), "");
}

// The store revisions named by an answer bound its contents from both sides.
TEST(BatchCheck, RefusesStatesOfOtherRevisions) {
  Operation batch = BatchAt(100, 101, {SeenAt("a", 1), SeenAt("c", 1)});
  batch.max_staleness = std::nullopt;
  batch.staleness = 90;
  EXPECT_EQ(FaultOf({batch}), "");
  batch.others.back().store_revision = 2;
  EXPECT_NE(FaultOf({batch}), "");
  batch.others.back() = SeenAt("c", 2);
  batch.others.front() = SeenAt("a", 2);
  EXPECT_EQ(FaultOf({batch}), "");
  batch.others.back().at_least_revision = 3;
  EXPECT_THAT(FaultOf({batch}), HasSubstr("of the store of c, requested with at least revision 3"));
  batch.others.back() = SeenAt("c", 2);
  batch.others.back().store_revision = 1;
  EXPECT_THAT(FaultOf({batch}), HasSubstr("revision 1 of the store of c contains a later one"));
}

}  // namespace batch_check_test
}  // namespace hulld::server
