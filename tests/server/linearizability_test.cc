// Concurrent clients on few hulls; their history is checked against the specification.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <initializer_list>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/history/made_up.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace linearizability_test {

using ::testing::HasSubstr;
using Kind = Operation::Kind;
using Outcome = Operation::Outcome;

// An answered operation on the incarnation that CreateAt creates.
Operation AnsweredOf(Kind kind, uint64_t invoked, uint64_t returned, uint64_t revision) {
  Operation operation = Answered(kind, invoked, returned, revision);
  operation.create_revision = 1;
  return operation;
}

Operation CreateAt(uint64_t invoked, uint64_t returned) {
  Operation operation = AnsweredOf(Kind::kCreate, invoked, returned, 1);
  operation.created = true;
  return operation;
}

// A chunk with one new point.
Operation AppendAt(uint64_t invoked, uint64_t returned, uint64_t revision, int point,
                   uint64_t vertex_count, const std::string& writer = "w", uint64_t sequence = 1) {
  Operation operation = AnsweredOf(Kind::kAppend, invoked, returned, revision);
  operation.incarnation = 1;
  operation.writer = writer;
  operation.sequence = sequence;
  operation.points = PointSet{1} << point;
  operation.sent = operation.received = operation.outside = 1;
  operation.vertex_count = vertex_count;
  return operation;
}

Operation Refused(Operation operation, Outcome outcome) {
  operation.outcome = outcome;
  return operation;
}

Operation MeshAt(uint64_t invoked, uint64_t returned, uint64_t revision, PointSet points) {
  Operation operation = AnsweredOf(Kind::kMesh, invoked, returned, revision);
  operation.points = points;
  return operation;
}

// A hull that received `points` points, all vertices.
Operation GetAt(uint64_t invoked, uint64_t returned, uint64_t revision, uint64_t create_revision,
                uint64_t points) {
  Operation operation = AnsweredOf(Kind::kGet, invoked, returned, revision);
  operation.create_revision = create_revision;
  operation.received = operation.outside = operation.vertex_count = points;
  return operation;
}

Operation ProbeAt(uint64_t invoked, uint64_t returned, uint64_t revision, int point,
                  bool touching) {
  Operation operation = AnsweredOf(Kind::kProbe, invoked, returned, revision);
  operation.probe = point;
  operation.touching = touching;
  return operation;
}

TEST(LinearizabilityCheck, AcceptsSequentialHistories) {
  EXPECT_EQ(LinearizabilityFault({}), "");
  // The probe overlaps the append and may see either side of it.
  for (const bool before : {false, true}) {
    EXPECT_EQ(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 6, 2, 5, 1),
                                    ProbeAt(4, 5, before ? 1 : 2, 5, !before)}),
              "");
  }
}

TEST(LinearizabilityCheck, AChangeWithoutAnAnswerMayOrMayNotHaveHappened) {
  Operation lost = AppendAt(3, UINT64_MAX, 0, 5, 1);
  lost.outcome = Outcome::kUnknown;
  EXPECT_EQ(LinearizabilityFault({CreateAt(1, 2), lost, ProbeAt(8, 9, 1, 5, false)}), "");
  EXPECT_EQ(LinearizabilityFault({CreateAt(1, 2), lost, ProbeAt(8, 9, 4, 5, true)}), "");
  // An effect cannot be visible and later disappear.
  EXPECT_NE(LinearizabilityFault(
                {CreateAt(1, 2), lost, ProbeAt(8, 9, 4, 5, true), ProbeAt(10, 11, 1, 5, false)}),
            "");
}

TEST(LinearizabilityCheck, AConditionMayFailBecauseOfAChangeWithoutAnAnswer) {
  Operation lost = AppendAt(3, 4, 0, 5, 1);
  lost.outcome = Outcome::kUnknown;
  Operation refused = AnsweredOf(Kind::kDelete, 5, 6, 0);
  refused.outcome = Outcome::kAborted;
  refused.if_revision = 1;
  EXPECT_EQ(LinearizabilityFault({CreateAt(1, 2), lost, refused, ProbeAt(7, 8, 4, 5, true)}), "");
  EXPECT_NE(LinearizabilityFault({CreateAt(1, 2), lost, refused, ProbeAt(7, 8, 1, 5, false)}), "");
}

TEST(LinearizabilityCheck, UnansweredCallsOfAnEndedServerDoNotHappenLater) {
  Operation lost = AppendAt(3, UINT64_MAX, 0, 5, 1);
  lost.outcome = Outcome::kUnknown;
  for (const bool settled : {false, true}) {
    HullHistory history;
    for (int i = 0; i < 10; ++i) history.Tick();
    history.Record("a", CreateAt(1, 2));
    history.Record("a", lost);
    if (settled) history.Settle();
    const uint64_t tick = history.Tick();
    history.Record("a", ProbeAt(tick, tick + 1, 1, 5, false));
    history.Record("a", ProbeAt(tick + 2, tick + 3, 4, 5, true));
    EXPECT_EQ(HistoryFault(history).empty(), !settled);
  }
}

TEST(LinearizabilityCheck, RefusesAStaleRead) {
  const std::string fault =
      LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), ProbeAt(5, 6, 1, 5, false)});
  EXPECT_THAT(fault, HasSubstr("explains more than 2 of 3"));
  EXPECT_THAT(fault, HasSubstr("probe [5, 6]"));
}

TEST(LinearizabilityCheck, RefusesALostUpdate) {
  // Two acknowledged appends, and a hull with only one of them.
  Operation get = AnsweredOf(Kind::kGet, 10, 11, 3);
  get.received = get.outside = get.vertex_count = 1;
  EXPECT_NE(LinearizabilityFault(
                {CreateAt(1, 2), AppendAt(3, 6, 2, 5, 1, "v"), AppendAt(4, 7, 3, 6, 2, "w"), get}),
            "");
  get.received = get.outside = get.vertex_count = 2;
  EXPECT_EQ(LinearizabilityFault(
                {CreateAt(1, 2), AppendAt(3, 6, 2, 5, 1, "v"), AppendAt(4, 7, 3, 6, 2, "w"), get}),
            "");
}

TEST(LinearizabilityCheck, RefusesAChunkAppliedTwiceOrOutOfOrder) {
  EXPECT_NE(
      LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), AppendAt(5, 6, 3, 6, 2)}), "");
  EXPECT_NE(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1, "w", 2)}), "");
}

TEST(LinearizabilityCheck, RefusesADecreasingRevision) {
  EXPECT_NE(LinearizabilityFault(
                {CreateAt(1, 2), AppendAt(3, 4, 5, 5, 1), AppendAt(5, 6, 4, 6, 2, "w", 2)}),
            "");
}

// Pipelined chunks with points 5 and 6 and a joint ack: the first at tick `returned`, the second at
// the next.
TEST(LinearizabilityCheck, ChunksReportedTogetherHappenedInOrder) {
  Operation first = AppendAt(3, 20, 0, 5, 0);
  first.shares_later_ack = true;
  Operation second = AppendAt(4, 21, 3, 6, 2, "w", 2);
  second.covers_earlier_chunks = true;
  second.received = second.outside = 2;
  const auto fault_of = [&](std::initializer_list<Operation> more) {
    std::vector<Operation> operations = {CreateAt(1, 2), first, second};
    operations.insert(operations.end(), more);
    return LinearizabilityFault(operations);
  };
  EXPECT_EQ(fault_of({}), "");
  EXPECT_EQ(fault_of({ProbeAt(5, 6, 2, 5, true), GetAt(7, 8, 3, 1, 2)}), "");
  EXPECT_EQ(fault_of({ProbeAt(5, 6, 1, 5, false)}), "");
  // The second chunk without the first, or a missing chunk, is refused.
  EXPECT_NE(fault_of({MeshAt(5, 6, 2, 0x40)}), "");
  EXPECT_NE(fault_of({ProbeAt(22, 23, 3, 5, false)}), "");
  EXPECT_NE(fault_of({GetAt(22, 23, 2, 1, 1)}), "");
  // Another writer's chunk in between is counted.
  EXPECT_NE(fault_of({AppendAt(5, 6, 4, 7, 2, "v")}), "");
  second.vertex_count = 3;
  EXPECT_NE(fault_of({}), "");
  EXPECT_EQ(fault_of({AppendAt(5, 6, 2, 7, 2, "v")}), "");
  // The second may have been sent before; the first was not.
  second.vertex_count = 2;
  second.sequence = 1;
  EXPECT_EQ(fault_of({ProbeAt(7, 8, 3, 5, true)}), "");
  second.sequence = 3;
  EXPECT_NE(fault_of({}), "");
}

TEST(LinearizabilityCheck, RefusesAConditionThatDidNotHold) {
  Operation conditional = AppendAt(5, 6, 3, 6, 2, "w", 2);
  conditional.if_revision = 1;
  EXPECT_NE(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), conditional}), "");
  conditional.if_revision = 2;
  EXPECT_EQ(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), conditional}), "");
  // Refusing a condition that held is a fault as well.
  conditional.outcome = Outcome::kAborted;
  EXPECT_NE(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), conditional}), "");
}

// A hull with point 5, at revision 2.
std::vector<Operation> After(std::initializer_list<Operation> more) {
  std::vector<Operation> operations = {CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1)};
  operations.insert(operations.end(), more);
  return operations;
}

TEST(LinearizabilityCheck, AReplaceIsOneChangeWithItsOwnCounts) {
  EXPECT_EQ(LinearizabilityFault(
                After({ReplaceAt(5, 6, 3, 0xc0), MeshAt(7, 8, 3, 0xc0), GetAt(9, 10, 3, 3, 2)})),
            "");
  // The mesh overlaps it and may see either side.
  for (const bool before : {false, true}) {
    EXPECT_EQ(LinearizabilityFault(After({ReplaceAt(5, 8, 3, 0xc0),
                                          before ? MeshAt(6, 7, 2, 0x20) : MeshAt(6, 7, 3, 0xc0),
                                          GetAt(9, 10, 3, 3, 2)})),
              "");
  }
  // No writer has a sequence in the new incarnation.
  Operation chunk = AppendAt(7, 8, 4, 8, 3);
  chunk.incarnation = 3;
  EXPECT_EQ(LinearizabilityFault(After({ReplaceAt(5, 6, 3, 0xc0), chunk})), "");
  chunk.sequence = 2;
  EXPECT_NE(LinearizabilityFault(After({ReplaceAt(5, 6, 3, 0xc0), chunk})), "");
}

TEST(LinearizabilityCheck, AReplaceWithoutAnAnswerMayOrMayNotHaveHappened) {
  const Operation lost = Unanswered(ReplaceAt(5, 6, 0, 0xc0));
  EXPECT_EQ(LinearizabilityFault(After({lost, MeshAt(7, 8, 2, 0x20), MeshAt(9, 10, 2, 0x20)})), "");
  EXPECT_EQ(LinearizabilityFault(After({lost, MeshAt(7, 8, 2, 0x20), MeshAt(9, 10, 4, 0xc0)})), "");
  // An effect cannot be visible and later disappear.
  EXPECT_NE(LinearizabilityFault(After({lost, MeshAt(7, 8, 4, 0xc0), MeshAt(9, 10, 2, 0x20)})), "");
  // Its revision equals the create revision until vertices are added.
  EXPECT_EQ(LinearizabilityFault(After({lost, MeshAt(7, 8, 4, 0xc0), GetAt(9, 10, 4, 4, 2)})), "");
  EXPECT_NE(LinearizabilityFault(After({lost, MeshAt(7, 8, 4, 0xc0), GetAt(9, 10, 4, 3, 2)})), "");
}

TEST(LinearizabilityCheck, RefusesAReplaceThatWasLost) {
  const Operation replace = ReplaceAt(5, 6, 3, 0xc0);
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(7, 8, 2, 0x20)})), "");
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(7, 8, 3, 0x20)})), "");
  EXPECT_NE(LinearizabilityFault(After({replace, ProbeAt(7, 8, 3, 5, true)})), "");
  EXPECT_NE(LinearizabilityFault(After({replace, GetAt(7, 8, 3, 1, 1)})), "");
  // Appends to the previous hull have no effect on the new one, and none succeeds later.
  EXPECT_NE(LinearizabilityFault(After({replace, AppendAt(7, 8, 4, 8, 3, "w", 2)})), "");
}

TEST(LinearizabilityCheck, RefusesAPartlyAppliedReplace) {
  const Operation replace = ReplaceAt(5, 8, 3, 0xc0);
  // New points are missing before or after the answer, or previous ones remain.
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(6, 7, 3, 0x40)})), "");
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(9, 10, 3, 0x80)})), "");
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(9, 10, 3, 0xe0)})), "");
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(9, 10, 3, 0)})), "");
  // Also for an unanswered replacement.
  const Operation lost = Unanswered(replace);
  EXPECT_NE(LinearizabilityFault(After({lost, MeshAt(9, 10, 3, 0x40)})), "");
  EXPECT_NE(LinearizabilityFault(After({lost, MeshAt(9, 10, 3, 0xe0)})), "");
  // The points are new, but the counts or the incarnation are old.
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(9, 10, 3, 0xc0), GetAt(11, 12, 3, 3, 3)})),
            "");
  EXPECT_NE(LinearizabilityFault(After({replace, MeshAt(9, 10, 3, 0xc0), GetAt(11, 12, 3, 1, 2)})),
            "");
  // The previous writer's sequence is still known.
  Operation open = GetAt(9, 10, 3, 3, 2);
  open.kind = Kind::kOpen;
  open.writer = "w";
  EXPECT_EQ(LinearizabilityFault(After({replace, open})), "");
  open.last_sequence = 1;
  EXPECT_NE(LinearizabilityFault(After({replace, open})), "");
}

TEST(LinearizabilityCheck, RefusesAReplaceThatWasAppliedTwice) {
  // Visible, then another change, then visible again.
  Operation chunk = AppendAt(9, 10, 4, 8, 3);
  chunk.incarnation = 3;
  const std::vector<Operation> twice = {MeshAt(7, 8, 3, 0xc0), chunk, MeshAt(11, 12, 5, 0xc0)};
  for (const bool answered : {false, true}) {
    const Operation replace = ReplaceAt(5, 6, 3, 0xc0);
    std::vector<Operation> operations = After({answered ? replace : Unanswered(replace)});
    operations.insert(operations.end(), twice.begin(), twice.end());
    EXPECT_NE(LinearizabilityFault(operations), "");
    // A second one explains it.
    operations.push_back(Unanswered(ReplaceAt(6, 7, 0, 0xc0)));
    EXPECT_EQ(LinearizabilityFault(operations), "");
  }
  // Applied twice in a row, which only the revision shows.
  EXPECT_NE(LinearizabilityFault(After({ReplaceAt(5, 6, 3, 0xc0), GetAt(7, 8, 4, 4, 2)})), "");
  // Counts of both hulls.
  EXPECT_NE(LinearizabilityFault(After({ReplaceAt(5, 6, 3, 0xc0), GetAt(7, 8, 3, 3, 4)})), "");
}

TEST(LinearizabilityCheck, AReplaceHappensOnlyWhereItsConditionHolds) {
  Operation replace = ReplaceAt(5, 6, 3, 0xc0);
  for (const uint64_t revision : {0, 1, 2, 3}) {
    replace.if_revision = revision;
    EXPECT_EQ(LinearizabilityFault(After({replace})).empty(), revision == 2);
    EXPECT_EQ(LinearizabilityFault(After({Refused(replace, Outcome::kAborted)})).empty(),
              revision != 2);
    EXPECT_NE(LinearizabilityFault(After({Refused(replace, Outcome::kNotFound)})), "");
  }
  // Without a hull, only condition 0 holds, and the hull is created only if requested.
  replace = ReplaceAt(1, 2, 1, 0xc0);
  for (const uint64_t revision : {0, 1}) {
    for (const bool if_absent : {false, true}) {
      replace.if_revision = revision;
      replace.if_absent = if_absent;
      replace.created = true;
      const bool made = revision == 0 && if_absent;
      EXPECT_EQ(LinearizabilityFault({replace}).empty(), made);
      EXPECT_EQ(LinearizabilityFault({Refused(replace, Outcome::kNotFound)}).empty(),
                revision == 0 && !if_absent);
      EXPECT_EQ(LinearizabilityFault({Refused(replace, Outcome::kAborted)}).empty(), revision != 0);
      replace.created = false;
      EXPECT_NE(LinearizabilityFault({replace}), "");
    }
  }
}

TEST(LinearizabilityCheck, RefusesAReplaceWithTheRevisionOfAnotherChange) {
  HullHistory history;
  history.Record("a", CreateAt(1, 2));
  history.Record("b", ReplaceAt(3, 4, 1, 0xc0));
  EXPECT_THAT(HistoryFault(history), HasSubstr("revision 1 belongs to a change of a and to one"));
}

TEST(LinearizabilityCheck, RefusesDecreasingStoreRevisions) {
  HullHistory history;
  history.Record("a", CreateAt(1, 2));
  Operation late = AnsweredOf(Kind::kProbe, 3, 4, 1);
  late.store_revision = 0;
  history.Record("a", late);
  EXPECT_THAT(HistoryFault(history), HasSubstr("the store reported revision 0 at tick 3"));
}

// A hull with point 5 since tick 102, at revision 2, and a probe at ticks 200 to 201 with this
// staleness, hull revision, and store revision.
Operation PastProbe(std::optional<uint64_t> bound, uint64_t staleness, uint64_t revision,
                    bool touching) {
  Operation probe = ProbeAt(200, 201, revision, 5, touching);
  probe.max_staleness = bound;
  probe.staleness = staleness;
  return probe;
}
std::string FaultOf(const Operation& probe) {
  return LinearizabilityFault({CreateAt(1, 2), AppendAt(100, 102, 2, 5, 1), probe});
}

TEST(FreshnessCheck, ABoundedReadMayBeAsStaleAsItsBound) {
  EXPECT_NE(FaultOf(PastProbe(0, 0, 1, false)), "");
  EXPECT_EQ(FaultOf(PastProbe(150, 98, 1, false)), "");
  EXPECT_EQ(FaultOf(PastProbe(150, 150, 1, false)), "");
  EXPECT_EQ(FaultOf(PastProbe(150, 150, 2, true)), "");
  // The change was acknowledged before that.
  EXPECT_NE(FaultOf(PastProbe(150, 97, 1, false)), "");
  // An answer from before the hull existed.
  Operation too_early = PastProbe(199, 199, 1, false);
  EXPECT_EQ(FaultOf(too_early), "");
  too_early.outcome = Outcome::kNotFound;
  too_early.store_revision = 0;
  EXPECT_EQ(FaultOf(too_early), "");
  too_early.max_staleness = 197;
  EXPECT_NE(FaultOf(too_early), "");
}

TEST(FreshnessCheck, RefusesAnAnswerStalerThanRequested) {
  EXPECT_THAT(FaultOf(PastProbe(149, 150, 2, true)), HasSubstr("150 ns ago, requested with"));
  EXPECT_EQ(FaultOf(PastProbe(std::nullopt, 150, 2, true)), "");
}

TEST(FreshnessCheck, ARequestedRevisionIsSeen) {
  Operation probe = PastProbe(std::nullopt, 199, 1, false);
  probe.at_least_revision = 1;
  EXPECT_EQ(FaultOf(probe), "");
  probe.at_least_revision = 2;
  EXPECT_THAT(FaultOf(probe), HasSubstr("requested with at least revision 2"));
  // A hull created by that time cannot be missing.
  probe.outcome = Outcome::kNotFound;
  probe.store_revision = 0;
  EXPECT_NE(FaultOf(probe), "");
  probe.at_least_revision = 0;
  EXPECT_EQ(FaultOf(probe), "");
}

// The answer names a revision whose changes it lacks.
TEST(FreshnessCheck, RefusesAnAnswerThatLacksAChangeUpToItsRevision) {
  Operation probe = PastProbe(150, 150, 1, false);
  probe.store_revision = 2;
  EXPECT_NE(FaultOf(probe), "");
  probe.store_revision = 1;
  EXPECT_EQ(FaultOf(probe), "");
}

class Linearizability : public ServerTest {};

TEST_F(Linearizability, ConcurrentClientsSeeOneHullAtATime) {
  constexpr int kRounds = 8;
  constexpr int kClients = 8;
  constexpr int kCalls = 150;
  size_t acknowledged = 0;
  size_t refused = 0;
  size_t replaced = 0;
  size_t replaces_refused = 0;
  for (int round = 0; round < kRounds; ++round) {
    Restart(TestConfig());
    HullHistory history;
    HistoryClient(channel_, history, "probe", 0).MakeProbe();
    std::vector<std::thread> threads;
    for (int i = 0; i < kClients; ++i) {
      threads.emplace_back([&, i] {
        // Separate channels, so that calls of clients overtake each other.
        grpc::ChannelArguments own;
        own.SetInt("hulld.test.client", i);
        HistoryClient client(
            grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), own),
            history, absl::StrCat("client-", i), static_cast<uint64_t>(1000 * round + i));
        for (int call = 0; call < kCalls; ++call) {
          client.CallAtRandom(call % 3 == 0 ? "shared/a" : "shared/b");
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(HistoryFault(history), "") << "round " << round;
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        acknowledged += operation.outcome == Outcome::kOk;
        refused += operation.outcome == Outcome::kAborted;
        if (operation.kind != Kind::kReplace) continue;
        replaced += operation.outcome == Outcome::kOk;
        replaces_refused += operation.outcome == Outcome::kAborted;
      }
    }
  }
  RecordProperty("acknowledged", static_cast<int>(acknowledged));
  RecordProperty("replaced", static_cast<int>(replaced));
  RecordProperty("replaces_refused", static_cast<int>(replaces_refused));
  // The histories cover the intended cases.
  EXPECT_GT(acknowledged, size_t{kRounds * kClients * kCalls / 2});
  EXPECT_GT(refused, size_t{kRounds * 10});
  EXPECT_GT(replaced, size_t{kRounds * 20});
  EXPECT_GT(replaces_refused, size_t{kRounds * 2});
}

}  // namespace linearizability_test
}  // namespace hulld::server
