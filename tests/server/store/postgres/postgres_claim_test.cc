// Several servers over one database: one is active, and a superseded server changes nothing.

#include <absl/strings/str_cat.h>

#include <future>
#include <thread>

#include "tests/server/harness/captured_log.h"
#include "tests/server/store/postgres/postgres_fixture.h"

namespace hulld::server {
namespace postgres_claim_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class PostgresClaim : public PostgresTest {};

// True for the session whose lock makes its server the active one.
constexpr char kHasLock[] =
    "pid IN (SELECT pid FROM pg_locks JOIN pg_database ON database = pg_database.oid WHERE "
    "locktype = 'advisory' AND granted AND pg_database.datname = current_database())";

TEST_F(PostgresClaim, ASupersededServerCommitsNothing) {
  // The server sends no heartbeat during this test: the database refuses it.
  options_.heartbeat = std::chrono::hours(1);
  Start();
  const AppendSession session = hulls_->Open("h")->session;
  ASSERT_TRUE(hulls_->Append(session, 1, CubeCorners()).ok());
  const std::unique_ptr<PostgresRegistry> former = std::move(hulls_);
  bool ended = false;
  former->store().OnEnded([&] { ended = true; });
  options_.take_over = true;
  Start();
  ASSERT_TRUE(hulls_->Put("h", {{9, 9, 9}}, "other").ok());
  EXPECT_GT(hulls_->store().epoch(), former->store().epoch());
  EXPECT_FALSE(ended);

  const absl::Status refused = former->Append(session, 2, {{5, 5, 5}}).status();
  EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("another hulld took over"));
  EXPECT_TRUE(ended);
  EXPECT_TRUE(absl::IsUnavailable(former->Create("new").status()));
  EXPECT_TRUE(absl::IsUnavailable(former->Delete("h").status()));
  EXPECT_EQ(ReceivedAfterRestart("h"), 9);
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, 1);
}

// The stored state may be newer than the server's; that is not damage.
TEST_F(PostgresClaim, ASupersededServerReadsNothing) {
  options_.heartbeat = std::chrono::hours(1);
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  Start();
  const std::unique_ptr<PostgresRegistry> former = std::move(hulls_);
  bool ended = false;
  former->store().OnEnded([&] { ended = true; });
  options_.take_over = true;
  Start();
  ASSERT_TRUE(hulls_->Delete("h").ok());
  EXPECT_TRUE(absl::IsUnavailable(former->View("h").status()));
  EXPECT_TRUE(ended);
  EXPECT_EQ(former->registry().Cache().damaged, 0);
}

TEST_F(PostgresClaim, AnIdleServerNoticesThatItWasSuperseded) {
  options_.heartbeat = std::chrono::milliseconds(10);
  Start();
  std::promise<void> ended;
  hulls_->store().OnEnded([&] { ended.set_value(); });
  const std::unique_ptr<PostgresRegistry> former = std::move(hulls_);
  options_.take_over = true;
  Start();
  ended.get_future().get();
}

TEST_F(PostgresClaim, AServerWaitsUntilTheActiveOneEnds) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  std::promise<void> queried;
  bool was_queried = false;
  options_.should_stop = [&] {
    if (!std::exchange(was_queried, true)) queried.set_value();
    return false;
  };
  auto next = std::async(std::launch::async, [this] { return Open(); });
  // The server found the store claimed.
  queried.get_future().get();
  EXPECT_TRUE(hulls_->Put("h", {{9, 9, 9}}).ok());
  hulls_ = nullptr;
  absl::StatusOr<std::unique_ptr<PostgresStore>> store = next.get();
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_EQ(PostgresRegistry(*std::move(store)).View("h")->record.counts.received, 9);
}

TEST_F(PostgresClaim, AWaitingServerCanBeStopped) {
  Start();
  options_.should_stop = [] { return true; };
  EXPECT_TRUE(absl::IsCancelled(Open().status()));
}

// The active server's machine is cut off or the server hangs: the database ends its session, which
// held the lock.
TEST_F(PostgresClaim, AWaitingServerTakesOverWhenTheActiveOneLosesItsLock) {
  options_.heartbeat = std::chrono::hours(1);
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  auto next = std::async(std::launch::async, [this] { return Open(); });
  EndSessions(kHasLock);
  absl::StatusOr<std::unique_ptr<PostgresStore>> store = next.get();
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_TRUE(absl::IsUnavailable(hulls_->Put("h", {{9, 9, 9}}).status()));
  EXPECT_EQ(PostgresRegistry(*std::move(store)).View("h")->record.counts.received, 8);
}

TEST_F(PostgresClaim, AServerReclaimsALostLock) {
  options_.heartbeat = std::chrono::milliseconds(10);
  Start();
  const uint64_t epoch = hulls_->store().epoch();
  EndSessions(kHasLock);
  // Bounded only by the time limit of the test.
  while (RunSql(absl::StrCat("SELECT 1 FROM pg_stat_activity WHERE ", kHasLock)).empty()) {
    std::this_thread::yield();
  }
  EXPECT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  EXPECT_EQ(hulls_->store().epoch(), epoch);
}

TEST_F(PostgresClaim, WithoutSyncAnUncleanStoreGetsANewId) {
  RunSql("ALTER ROLE hulld SET synchronous_commit = off");
  Start();
  EXPECT_EQ(hulls_->store().durability(), Durability::kRelaxed);
  const std::string id = hulls_->store().id();
  Start();
  EXPECT_EQ(hulls_->store().id(), id);
  const std::unique_ptr<PostgresRegistry> former = std::move(hulls_);
  options_.take_over = true;
  Start();
  EXPECT_NE(hulls_->store().id(), id);
  RunSql("ALTER ROLE hulld RESET synchronous_commit");
  Start();
  EXPECT_EQ(hulls_->store().durability(), Durability::kSync);
}

// A killed migration leaves its source without a clean end.
TEST_F(PostgresClaim, TheSourceOfAMigrationStaysTheSameStore) {
  RunSql("ALTER ROLE hulld SET synchronous_commit = off");
  Start();
  hulls_ = nullptr;
  options_.must_exist = true;
  Start();
  EXPECT_EQ(hulls_->store().durability(), Durability::kSync);
  EXPECT_THAT(RunSql("SELECT relaxed FROM hulld.store"), ElementsAre("f"));
  RunSql("ALTER ROLE hulld RESET synchronous_commit");
}

TEST_F(PostgresClaim, ARestoredDatabaseGetsANewId) {
  Start();
  const std::string id = hulls_->store().id();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  // Simulates a failover to a standby that lagged behind.
  RunSql("UPDATE hulld.store SET batch = batch - 1");
  EndSessions("true");
  EXPECT_TRUE(absl::IsUnavailable(hulls_->Put("h", {{9, 9, 9}}).status()));
  Start();
  EXPECT_NE(hulls_->store().id(), id);
}

TEST_F(PostgresClaim, AWrongPasswordIsReportedAndNotShown) {
  options_.conninfo = absl::StrCat("host=", proxy_->directory(), " dbname=", database_,
                                   " user=hulld password=falsches-Wort");
  const CapturedLog log;
  const absl::Status status = Open().status();
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("password authentication failed"));
  EXPECT_THAT(std::string(status.message()), HasSubstr("--postgres-conninfo-file"));
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("falsches-Wort")));
  EXPECT_THAT(log.text(), Not(HasSubstr("falsches-Wort")));
}

TEST_F(PostgresClaim, ARoleWithoutRightsGetsAnErrorThatNamesTheGrant) {
  RunSql("CREATE ROLE stranger LOGIN PASSWORD 'fremd'");
  options_.conninfo = absl::StrCat("host=", proxy_->directory(), " dbname=", database_,
                                   " user=stranger password=fremd");
  const absl::Status status = Open().status();
  EXPECT_THAT(std::string(status.message()), HasSubstr("CREATE SCHEMA hulld AUTHORIZATION"));
}

TEST_F(PostgresClaim, ABackupIsLeftToPostgreSql) {
  const absl::Status status = Start().store().MakeCopy().status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("pg_dump"));
}

TEST_F(PostgresClaim, TableSizesAreKnownAndFreeSpaceIsNot) {
  const std::optional<StoreDisk> disk = Start().store().disk();
  ASSERT_TRUE(disk.has_value());
  EXPECT_GT(disk->bytes, 0);
  EXPECT_FALSE(disk->free_bytes.has_value());
}

}  // namespace postgres_claim_test
}  // namespace hulld::server
