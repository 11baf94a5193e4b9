// Concurrent clients of few hulls; what they saw is checked against the specification.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "tests/server/history_client.h"
#include "tests/server/hull_history.h"
#include "tests/server/test_server.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;
using Kind = Operation::Kind;
using Outcome = Operation::Outcome;

Operation Answered(Kind kind, uint64_t invoked, uint64_t returned, uint64_t revision) {
  Operation operation;
  operation.kind = kind;
  operation.outcome = Outcome::kOk;
  operation.invoked = invoked;
  operation.returned = returned;
  operation.store_revision = operation.revision = revision;
  operation.create_revision = 1;
  return operation;
}

Operation CreateAt(uint64_t invoked, uint64_t returned) {
  Operation operation = Answered(Kind::kCreate, invoked, returned, 1);
  operation.created = true;
  return operation;
}

// One chunk of one point, which was new.
Operation AppendAt(uint64_t invoked, uint64_t returned, uint64_t revision, int point,
                   uint64_t vertex_count, const std::string& writer = "w", uint64_t sequence = 1) {
  Operation operation = Answered(Kind::kAppend, invoked, returned, revision);
  operation.incarnation = 1;
  operation.writer = writer;
  operation.sequence = sequence;
  operation.points = PointSet{1} << point;
  operation.sent = operation.received = operation.outside = 1;
  operation.vertex_count = vertex_count;
  return operation;
}

Operation ProbeAt(uint64_t invoked, uint64_t returned, uint64_t revision, int point,
                  bool touching) {
  Operation operation = Answered(Kind::kProbe, invoked, returned, revision);
  operation.probe = point;
  operation.touching = touching;
  return operation;
}

TEST(LinearizabilityCheck, AcceptsWhatOneThingAtATimeCouldAnswer) {
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
  // But not happen and then not have happened.
  EXPECT_NE(LinearizabilityFault(
                {CreateAt(1, 2), lost, ProbeAt(8, 9, 4, 5, true), ProbeAt(10, 11, 1, 5, false)}),
            "");
}

TEST(LinearizabilityCheck, AConditionMayFailBecauseOfAChangeWithoutAnAnswer) {
  Operation lost = AppendAt(3, 4, 0, 5, 1);
  lost.outcome = Outcome::kUnknown;
  Operation refused = Answered(Kind::kDelete, 5, 6, 0);
  refused.outcome = Outcome::kAborted;
  refused.if_revision = 1;
  EXPECT_EQ(LinearizabilityFault({CreateAt(1, 2), lost, refused, ProbeAt(7, 8, 4, 5, true)}), "");
  EXPECT_NE(LinearizabilityFault({CreateAt(1, 2), lost, refused, ProbeAt(7, 8, 1, 5, false)}), "");
}

TEST(LinearizabilityCheck, WhatAnEndedServerDidNotAnswerCannotHappenLater) {
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
  // Two acknowledged appends, and a hull with one of them.
  Operation get = Answered(Kind::kGet, 10, 11, 3);
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

TEST(LinearizabilityCheck, RefusesARevisionThatFalls) {
  EXPECT_NE(LinearizabilityFault(
                {CreateAt(1, 2), AppendAt(3, 4, 5, 5, 1), AppendAt(5, 6, 4, 6, 2, "w", 2)}),
            "");
}

TEST(LinearizabilityCheck, RefusesAConditionThatDidNotHold) {
  Operation conditional = AppendAt(5, 6, 3, 6, 2, "w", 2);
  conditional.if_revision = 1;
  EXPECT_NE(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), conditional}), "");
  conditional.if_revision = 2;
  EXPECT_EQ(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), conditional}), "");
  // And a refusal of one that did.
  conditional.outcome = Outcome::kAborted;
  EXPECT_NE(LinearizabilityFault({CreateAt(1, 2), AppendAt(3, 4, 2, 5, 1), conditional}), "");
}

TEST(LinearizabilityCheck, RefusesRevisionsOfTheStoreThatFall) {
  HullHistory history;
  history.Record("a", CreateAt(1, 2));
  Operation late = Answered(Kind::kProbe, 3, 4, 1);
  late.store_revision = 0;
  history.Record("a", late);
  EXPECT_THAT(HistoryFault(history), HasSubstr("the store told revision 0 at tick 3"));
}

class Linearizability : public ServerTest {};

TEST_F(Linearizability, ConcurrentClientsSeeOneHullAtATime) {
  constexpr int kRounds = 8;
  constexpr int kClients = 8;
  constexpr int kCalls = 150;
  size_t acknowledged = 0;
  size_t refused = 0;
  for (int round = 0; round < kRounds; ++round) {
    Restart(TestConfig());
    HullHistory history;
    HistoryClient(channel_, history, "probe", 0).MakeProbe();
    std::vector<std::thread> threads;
    for (int i = 0; i < kClients; ++i) {
      threads.emplace_back([&, i] {
        // A channel of its own, so that calls of clients overtake each other.
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
      }
    }
  }
  RecordProperty("acknowledged", static_cast<int>(acknowledged));
  // The histories hold what they are to test.
  EXPECT_GT(acknowledged, size_t{kRounds * kClients * kCalls / 2});
  EXPECT_GT(refused, size_t{kRounds * 10});
}

}  // namespace
}  // namespace hulld::server
