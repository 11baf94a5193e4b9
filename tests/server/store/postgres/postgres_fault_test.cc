// Failures of the database or of the network while hulls grow.

#include <absl/strings/str_cat.h>

#include <future>
#include <thread>

#include "tests/server/store/postgres/postgres_fixture.h"

namespace hulld::server {
namespace postgres_fault_test {

using ::testing::HasSubstr;
using Cut = CuttingProxy::Cut;

class PostgresFault : public PostgresTest {
 protected:
  void TearDown() override {
    if (proxy_ != nullptr) proxy_->SetDown(false);
    PostgresTest::TearDown();
  }
  uint64_t Received() { return hulls_->View("h")->record.counts.received; }
};

TEST_F(PostgresFault, ACommitWithALostAnswerIsFoundAndNotRepeated) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const std::string batches = RunSql("SELECT batch FROM hulld.store").front();
  proxy_->CutNext(Cut::kAfterCommit);
  const auto put = hulls_->Put("h", {{9, 9, 9}});
  ASSERT_TRUE(put.ok()) << put.status();
  EXPECT_EQ(proxy_->cuts(), 1);
  EXPECT_EQ(RunSql(absl::StrCat("SELECT batch - ", batches, " FROM hulld.store")).front(), "1");
  EXPECT_EQ(Received(), 9);
  ASSERT_TRUE(hulls_->Put("h", {{10, 9, 9}}).ok());
  EXPECT_EQ(ReceivedAfterRestart("h"), 10);
}

TEST_F(PostgresFault, ACommitThatDidNotArriveIsRepeated) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  proxy_->CutNext(Cut::kBeforeCommit);
  const auto put = hulls_->Put("h", {{9, 9, 9}});
  ASSERT_TRUE(put.ok()) << put.status();
  EXPECT_EQ(proxy_->cuts(), 1);
  EXPECT_EQ(ReceivedAfterRestart("h"), 9);
}

// A delayed transaction arrives after later ones. It adds no vertex, so no table key rejects it.
TEST_F(PostgresFault, ALateTransactionChangesNothing) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  proxy_->CutNext(Cut::kHold);
  ASSERT_TRUE(hulls_->Put("h", {{0.5, 0.5, 0.5}}).ok());
  EXPECT_EQ(proxy_->cuts(), 1);
  ASSERT_TRUE(hulls_->Put("h", {{0.25, 0.5, 0.5}}).ok());
  const std::string before = RunSql("SELECT s::text FROM hulld.store s").front();
  proxy_->Deliver();
  EXPECT_EQ(RunSql("SELECT s::text FROM hulld.store s").front(), before);
  EXPECT_EQ(ReceivedAfterRestart("h"), 10);
  EXPECT_EQ(hulls_->Open("h")->last_sequence, 3);
}

// While the outcome cannot be determined, the error says so and further changes are refused.
TEST_F(PostgresFault, AnUnknownOutcomeIsReported) {
  options_.retry_timeout = std::chrono::milliseconds(0);
  for (const Cut cut : {Cut::kBeforeCommit, Cut::kAfterCommit}) {
    const std::string id = cut == Cut::kAfterCommit ? "after" : "before";
    Start();
    ASSERT_TRUE(hulls_->Put(id, CubeCorners()).ok());
    bool ended = false;
    hulls_->store().OnEnded([&] { ended = true; });
    proxy_->CutNext(cut);
    proxy_->GoDownWithCut();
    const absl::Status unknown = hulls_->Put(id, {{9, 9, 9}}).status();
    EXPECT_TRUE(absl::IsUnavailable(unknown)) << unknown;
    EXPECT_THAT(std::string(unknown.message()), HasSubstr("may appear"));
    EXPECT_TRUE(absl::IsUnavailable(hulls_->Create("new").status()));
    // The change is not visible; queries continue.
    EXPECT_EQ(hulls_->View(id)->record.counts.received, 8);
    EXPECT_FALSE(ended);
    proxy_->SetDown(false);
    const absl::Status next = hulls_->Create(id + "/next").status();
    // If the refused change turns out to be stored, this server stops and leaves it to its
    // successor.
    EXPECT_EQ(ended, cut == Cut::kAfterCommit);
    EXPECT_EQ(next.ok(), cut == Cut::kBeforeCommit) << next;
    EXPECT_EQ(ReceivedAfterRestart(id), cut == Cut::kAfterCommit ? 9 : 8);
  }
}

TEST_F(PostgresFault, WritersDoNotNoticeARestartOfTheDatabase) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  ASSERT_TRUE(hulls_->Put("cold", SpherePoints(100)).ok());
  StoredHull cold;
  ASSERT_TRUE(hulls_->store()
                  .ForEachRecord(
                      [&](const std::string& id, const absl::StatusOr<StoredHull>& hull) {
                        if (id == "cold") cold = *hull;
                      },
                      [](const auto&...) {})
                  .ok());
  for (int round = 0; round < 2; ++round) {
    if (round == 0) {
      cluster().StopImmediately();
    } else {
      cluster().Kill();
    }
    cluster().Start();
    const auto put = hulls_->Put("h", {{9.0 + round, 9, 9}});
    EXPECT_TRUE(put.ok()) << put.status();
    EXPECT_TRUE(hulls_->store().LoadVertices(cold).ok());
  }
  EXPECT_EQ(ReceivedAfterRestart("h"), 10);
}

TEST_F(PostgresFault, AnUnreachableDatabaseRefusesOnlyChanges) {
  options_.retry_timeout = std::chrono::milliseconds(50);
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const HullView before = *hulls_->View("h");
  const AppendSession session = hulls_->Open("h")->session;
  for (int round = 0; round < 2; ++round) {
    proxy_->SetDown(true);
    for (int attempt = 0; attempt < 3; ++attempt) {
      EXPECT_TRUE(absl::IsUnavailable(hulls_->Append(session, 2, {{9, 9, 9}}).status()));
      EXPECT_TRUE(absl::IsUnavailable(hulls_->Create("new").status()));
      EXPECT_EQ(hulls_->View("h")->record, before.record);
    }
    proxy_->SetDown(false);
  }
  EXPECT_GT(hulls_->store().failures().write, 0);
  // The stream continues without a restart. On a busy machine, connecting takes longer than the
  // store keeps trying.
  auto accepted = hulls_->Append(session, 2, {{9, 9, 9}});
  while (absl::IsUnavailable(accepted.status())) {
    accepted = hulls_->Append(session, 2, {{9, 9, 9}});
  }
  ASSERT_TRUE(accepted.ok()) << accepted.status();
  EXPECT_EQ(ReceivedAfterRestart("h"), 9);
}

// The database neither answers nor closes its connections.
TEST_F(PostgresFault, AHungDatabaseBlocksNoThreadForever) {
  options_.answer_timeout = std::chrono::milliseconds(200);
  options_.retry_timeout = std::chrono::milliseconds(100);
  options_.conninfo += " connect_timeout=2";
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  cluster().Suspend();
  EXPECT_TRUE(absl::IsUnavailable(hulls_->Put("h", {{9, 9, 9}}).status()));
  EXPECT_TRUE(
      absl::IsUnavailable(hulls_->store().LoadSequence(hulls_->View("h")->record, "x").status()));
  cluster().Resume();
  // Whatever the outcome of the first change, the next server agrees with this one if it continues.
  // If this one stopped, its unanswered changes may be stored or not.
  const bool goes_on = hulls_->Put("h", {{10, 9, 9}}).ok();
  const uint64_t received = Received();
  const uint64_t stored = ReceivedAfterRestart("h");
  if (goes_on) {
    EXPECT_EQ(stored, received);
  } else {
    EXPECT_GE(stored, 8);
    EXPECT_LE(stored, 10);
  }
}

// The database rejects the transaction and keeps none of it.
TEST_F(PostgresFault, ARefusedTransactionLeavesNothing) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  RunSql("ALTER TABLE hulld.deltas ADD CONSTRAINT never CHECK (length(vertices) < 20) NOT VALID");
  const absl::Status refused = hulls_->Put("h", {{9, 9, 9}}).status();
  EXPECT_TRUE(absl::IsUnavailable(refused));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("nothing was changed"));
  EXPECT_EQ(RunSql("SELECT batch FROM hulld.store").front(), "2");
  RunSql("ALTER TABLE hulld.deltas DROP CONSTRAINT never");
  EXPECT_TRUE(hulls_->Put("h", {{10, 9, 9}}).ok());
  EXPECT_EQ(ReceivedAfterRestart("h"), 9);
}

// PostgreSQL reports a commit with a warning that a standby may lack it.
TEST_F(PostgresFault, ACancelledWaitForAStandbyIsNotAnAcknowledgement) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  RunSql("ALTER SYSTEM SET synchronous_standby_names = 'nobody'");
  RunSql("SELECT pg_reload_conf()");
  std::future<absl::StatusOr<ChunkResult>> put;
  const std::string waiting = "wait_event = 'SyncRep' AND datname = current_database()";
  const auto await = [&](const std::string& condition) {
    while (RunSql("SELECT 1 FROM pg_stat_activity WHERE " + condition).empty() &&
           put.wait_for(std::chrono::seconds(0)) == std::future_status::timeout) {
      std::this_thread::yield();
    }
  };
  // Until the database has reloaded its settings, commits do not wait.
  int puts = 0;
  do {
    put = std::async(std::launch::async, [this] { return hulls_->Put("h", {{9, 9, 9}}); });
    ++puts;
    await(waiting);
  } while (put.wait_for(std::chrono::seconds(0)) == std::future_status::ready);
  const std::string first = RunSql("SELECT pid FROM pg_stat_activity WHERE " + waiting).front();
  const std::string epoch = RunSql("SELECT epoch FROM hulld.store").front();
  RunSql(absl::StrCat("SELECT pg_cancel_backend(", first, ")"));
  // A new session queries the outcome, which also waits for the standby.
  await(waiting + " AND pid <> " + first);
  EXPECT_EQ(put.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  RunSql("ALTER SYSTEM RESET synchronous_standby_names");
  RunSql("SELECT pg_reload_conf()");
  EXPECT_TRUE(put.get().ok());
  EXPECT_NE(RunSql("SELECT epoch FROM hulld.store").front(), epoch);
  EXPECT_EQ(ReceivedAfterRestart("h"), 8 + puts);
}

}  // namespace postgres_fault_test
}  // namespace hulld::server
