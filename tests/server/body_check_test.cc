// Tests of the history check for bodies and for stale reads.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/history/made_up.h"

namespace hulld::server {
namespace body_check_test {

using ::testing::HasSubstr;
using Kind = Operation::Kind;
using Outcome = Operation::Outcome;
using Operations = std::map<std::string, std::vector<Operation>>;

constexpr int kPoint = 3;

// A hull of one point: kPoint or the next.
constexpr PointSet kWith = PointSet{1} << kPoint;
constexpr PointSet kWithout = kWith << 1;

Operation PutAt(uint64_t invoked, uint64_t returned, uint64_t revision,
                std::vector<std::string> pieces, uint64_t create_revision = 10) {
  Operation operation = Answered(Kind::kPut, invoked, returned, revision);
  operation.create_revision = create_revision;
  operation.created = revision == create_revision;
  operation.pieces = std::move(pieces);
  return operation;
}

Operation GetAt(uint64_t invoked, uint64_t returned, uint64_t revision,
                std::vector<std::string> pieces) {
  Operation operation = PutAt(invoked, returned, revision, std::move(pieces));
  operation.kind = Kind::kGetBody;
  return operation;
}

// Returns a query at these revisions of the body, a, and c, with a certificate that names them.
Operation BodyQueryAt(uint64_t invoked, uint64_t returned, uint64_t revision, uint64_t a,
                      uint64_t c, bool touching) {
  Operation operation = Answered(Kind::kBodyQuery, invoked, returned, revision);
  operation.create_revision = 10;
  operation.probe = kPoint;
  operation.touching = touching;
  if (touching) operation.deciding = "a";
  operation.lists_pieces = true;
  operation.pieces = {"a", "c"};
  operation.others = {{"a", a, a, "", a}, {"c", c, c, "", c}};
  return operation;
}

Operation Missing(Operation operation, const std::string& missing) {
  operation.outcome = Outcome::kNotFound;
  operation.missing = missing;
  operation.others.clear();
  return operation;
}

// Hull a loses the point at ticks 21 to 22; c is replaced at 31 to 32. The body has both as pieces.
Operations With(const std::vector<Operation>& of_body) {
  Operations operations = {{"a", {ReplaceAt(1, 2, 1, kWith), ReplaceAt(21, 22, 2, kWithout)}},
                           {"b", {PutAt(5, 6, 10, {"a", "c"})}},
                           {"c", {ReplaceAt(3, 4, 1, kWithout), ReplaceAt(31, 32, 2, kWithout)}}};
  // Each has its own store, so revisions start at 1.
  for (auto& [id, of_id] : operations) {
    for (Operation& operation : of_id) operation.store_id = id;
  }
  auto& all = operations["b"];
  for (Operation operation : of_body) {
    operation.store_id = "b";
    all.push_back(operation);
  }
  return operations;
}
std::string FaultOf(const std::vector<Operation>& of_body) {
  return JointLinearizabilityFault(With(of_body));
}

TEST(BodyCheck, AcceptsAnswersOfOneInstant) {
  EXPECT_EQ(FaultOf({}), "");
  EXPECT_EQ(FaultOf({BodyQueryAt(10, 40, 10, 1, 1, true)}), "");
  EXPECT_EQ(FaultOf({BodyQueryAt(10, 40, 10, 2, 1, false)}), "");
  EXPECT_EQ(FaultOf({BodyQueryAt(10, 40, 10, 2, 2, false), GetAt(10, 40, 10, {"a", "c"})}), "");
}

// Each version existed during the call, but never all at the same time.
TEST(BodyCheck, RefusesHullsOfPiecesThatNeverCoexisted) {
  EXPECT_NE(FaultOf({BodyQueryAt(10, 40, 10, 1, 2, true)}), "");
  EXPECT_NE(FaultOf({BodyQueryAt(33, 40, 10, 2, 1, false)}), "");
}

TEST(BodyCheck, RefusesABodyAndAHullThatNeverCoexisted) {
  const Operation put = PutAt(25, 26, 11, {"c", "a"});
  EXPECT_EQ(FaultOf({put, BodyQueryAt(10, 40, 10, 1, 1, true)}), "");
  EXPECT_NE(FaultOf({put, BodyQueryAt(10, 40, 11, 1, 1, true)}), "");
  EXPECT_EQ(FaultOf({put, BodyQueryAt(10, 40, 11, 2, 2, false)}), "");
  EXPECT_NE(FaultOf({put, BodyQueryAt(10, 40, 10, 2, 2, false)}), "");
}

TEST(BodyCheck, RefusesARelationThatDoesNotFollowFromThePieces) {
  EXPECT_NE(FaultOf({BodyQueryAt(10, 40, 10, 1, 1, false)}), "");
  EXPECT_NE(FaultOf({BodyQueryAt(10, 40, 10, 2, 1, true)}), "");
  // A piece that does not touch cannot be the deciding one.
  Operation ask = BodyQueryAt(10, 40, 10, 1, 1, true);
  ask.deciding = "c";
  EXPECT_NE(FaultOf({ask}), "");
  // An answer without the names of the pieces is refused as well.
  ask = BodyQueryAt(23, 24, 10, 2, 1, true);
  ask.lists_pieces = false;
  ask.pieces.clear();
  ask.others.clear();
  EXPECT_NE(FaultOf({ask}), "");
  ask.touching = false;
  EXPECT_EQ(FaultOf({ask}), "");
}

TEST(BodyCheck, RefusesPiecesFromAnotherRevision) {
  EXPECT_NE(FaultOf({GetAt(7, 8, 10, {"a"})}), "");
  EXPECT_NE(FaultOf({GetAt(7, 8, 10, {"c", "a"})}), "");
  EXPECT_NE(FaultOf({PutAt(7, 8, 11, {"a"}), BodyQueryAt(10, 20, 11, 1, 1, true)}), "");
  Operation ask = BodyQueryAt(10, 20, 11, 1, 1, true);
  ask.pieces = {"a"};
  ask.others.pop_back();
  EXPECT_EQ(FaultOf({PutAt(7, 8, 11, {"a"}), ask}), "");
}

TEST(BodyCheck, APutKeepsTheIncarnationAndChecksItsCondition) {
  EXPECT_EQ(FaultOf({PutAt(7, 8, 11, {"a"}), GetAt(9, 10, 11, {"a"})}), "");
  EXPECT_NE(FaultOf({PutAt(7, 8, 11, {"a"}, 11)}), "");
  EXPECT_NE(FaultOf({PutAt(7, 8, 9, {"a"})}), "");
  Operation put = PutAt(7, 8, 11, {"a"});
  for (const uint64_t revision : {0, 9, 10}) {
    put.if_revision = revision;
    put.outcome = Outcome::kOk;
    EXPECT_EQ(FaultOf({put}).empty(), revision == 10);
    put.outcome = Outcome::kAborted;
    EXPECT_EQ(FaultOf({put}).empty(), revision != 10);
  }
}

TEST(BodyCheck, APutWithoutAnAnswerMayOrMayNotHaveHappened) {
  const Operation lost = Unanswered(PutAt(7, 8, 0, {"a"}));
  const Operation before = GetAt(11, 12, 10, {"a", "c"});
  const Operation after = GetAt(13, 14, 12, {"a"});
  EXPECT_EQ(FaultOf({lost, before}), "");
  EXPECT_EQ(FaultOf({lost, after}), "");
  EXPECT_EQ(FaultOf({lost, before, after}), "");
  // An effect cannot be visible and later disappear.
  EXPECT_NE(FaultOf({lost, after, GetAt(15, 16, 10, {"a", "c"})}), "");
}

TEST(BodyCheck, ExistingBodiesAreNotReportedMissing) {
  EXPECT_NE(FaultOf({Missing(BodyQueryAt(10, 40, 0, 0, 0, false), "")}), "");
  EXPECT_NE(FaultOf({Missing(BodyQueryAt(10, 40, 0, 0, 0, false), "c")}), "");
  EXPECT_EQ(FaultOf({Missing(BodyQueryAt(4, 40, 0, 0, 0, false), "")}), "");
  Operation gone = Answered(Kind::kDelete, 33, 34, 3);
  gone.store_id = "c";
  Operations operations = With({Missing(BodyQueryAt(10, 40, 0, 0, 0, false), "c")});
  operations["c"].push_back(gone);
  EXPECT_EQ(JointLinearizabilityFault(operations), "");
  // A piece cannot be missing from a body that does not contain it.
  operations = With({PutAt(7, 8, 11, {"a"}), Missing(BodyQueryAt(10, 40, 0, 0, 0, false), "c")});
  operations["c"].push_back(gone);
  EXPECT_NE(JointLinearizabilityFault(operations), "");
}

TEST(BodyCheck, ARequestedRevisionIsSeen) {
  Operation version = Answered(Kind::kProbe, 100, 101, 1);
  version.store_id = "c";
  version.max_staleness = std::nullopt;
  version.staleness = 99;
  const auto fault_of = [](const Operation& operation) {
    Operations operations = With({});
    operations["c"].push_back(operation);
    return JointLinearizabilityFault(operations);
  };
  EXPECT_EQ(fault_of(version), "");
  version.at_least_revision = 2;
  EXPECT_THAT(fault_of(version), HasSubstr("requested with at least revision 2"));
  // The answer names a revision whose changes it lacks.
  version.store_revision = 2;
  EXPECT_NE(fault_of(version), "");
  version.revision = version.create_revision = 2;
  EXPECT_EQ(fault_of(version), "");
  Operation ask = BodyQueryAt(100, 101, 10, 2, 2, false);
  EXPECT_EQ(FaultOf({ask}), "");
  ask.others.back().at_least_revision = 3;
  EXPECT_THAT(FaultOf({ask}), HasSubstr("of the store of c, requested with at least revision 3"));
}

// Changes of one store take effect in revision order.
TEST(BodyCheck, RefusesAnOrderThatContradictsRevisions) {
  Operations operations = With({});
  operations["a"].push_back(ReplaceAt(41, 60, 5, kWith));
  operations["b"].push_back(PutAt(41, 60, 20, {"a"}));
  // The body put later was seen with the hull's earlier version.
  Operation ask = BodyQueryAt(41, 60, 20, 2, 0, false);
  ask.pieces = {"a"};
  ask.others.pop_back();
  operations["b"].push_back(ask);
  operations["a"].back().store_id = operations["b"].back().store_id = "b";
  for (Operation& operation : operations["b"]) operation.store_id = "b";
  EXPECT_NE(JointLinearizabilityFault(operations), "");
  operations["a"].back().store_id = "a";
  EXPECT_EQ(JointLinearizabilityFault(operations), "");
}

}  // namespace body_check_test
}  // namespace hulld::server
