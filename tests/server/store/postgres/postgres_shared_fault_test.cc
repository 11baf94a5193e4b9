// Several servers over one database: lost and late answers, ended and stalled sessions, a restored
// database.
#include <absl/strings/str_cat.h>
#include <libpq-fe.h>

#include <chrono>
#include <future>
#include <string>
#include <thread>

#include "tests/server/store/postgres/postgres_shared_fixture.h"

namespace hulld::server {
namespace postgres_shared_fault_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Cut = CuttingProxy::Cut;

class PostgresSharedFault : public PostgresSharedTest {
 protected:
  // Wait, for at most a minute, until a session matches the condition, or none does.
  void AwaitSession(const std::string& condition) const { AwaitCount(condition, true); }
  void AwaitNoSession(const std::string& condition) const { AwaitCount(condition, false); }
  void AwaitCount(const std::string& condition, bool is_some) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    const std::string ask =
        "SELECT 1 FROM pg_stat_activity WHERE pid <> pg_backend_pid() AND " + condition;
    while (RunSql(ask).empty() == is_some) {
      if (std::chrono::steady_clock::now() > end) {
        ADD_FAILURE() << (is_some ? "no session reaches " : "a session remains at ") << condition;
        return;
      }
      std::this_thread::yield();
    }
  }
  // Creates a cube and appends a point; the proxy holds back the COMMIT until another session waits
  // for the lock. Returns the future of Put.
  auto PutAPointWhoseCommitIsHeld() {
    EXPECT_TRUE(hulls_->Put("h", CubeCorners()).ok());
    proxy_->CutNext(Cut::kHoldCommit);
    auto put = std::async(std::launch::async, [this] { return hulls_->Put("h", {{9, 9, 9}}); });
    AwaitSession("datname = current_database() AND wait_event_type = 'Lock'");
    return put;
  }
};

TEST_F(PostgresSharedFault, ACommitWithALostAnswerIsFoundAndNotRepeated) {
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  proxy_->CutNext(Cut::kAfterCommit);
  const auto put = hulls_->Put("h", {{9, 9, 9}});
  ASSERT_TRUE(put.ok()) << put.status();
  EXPECT_FALSE(put->already_applied);
  EXPECT_EQ(proxy_->cuts(), 1);
  EXPECT_EQ(Received(*other, "h"), 9);
  EXPECT_EQ(Received(*hulls_, "h"), 9);
  proxy_->CutNext(Cut::kBeforeCommit);
  ASSERT_TRUE(hulls_->Put("h", {{10, 9, 9}}).ok());
  EXPECT_EQ(proxy_->cuts(), 2);
  EXPECT_EQ(Received(*other, "h"), 10);
}

// The change is refused with an unknown outcome, and later applied as if a peer server had made it.
TEST_F(PostgresSharedFault, AnUnknownOutcomeIsResolvedLater) {
  options_.retry_timeout = std::chrono::milliseconds(0);
  for (const Cut cut : {Cut::kBeforeCommit, Cut::kAfterCommit}) {
    const std::string id = cut == Cut::kAfterCommit ? "after" : "before";
    Start();
    const Server other = StartPeer();
    ASSERT_TRUE(hulls_->Put(id, CubeCorners()).ok());
    const auto opened = hulls_->Open(id);
    proxy_->CutNext(cut);
    proxy_->GoDownWithCut();
    EXPECT_TRUE(absl::IsUnavailable(hulls_->Append(opened->session, 2, {{9, 9, 9}}).status()));
    // Changes of peer servers cannot be read.
    EXPECT_TRUE(absl::IsUnavailable(hulls_->View(id).status()));
    ASSERT_TRUE(other->Put(id, {{10, 9, 9}}, "v").ok());
    proxy_->SetDown(false);
    const auto again = hulls_->Append(opened->session, 2, {{9, 9, 9}});
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->already_applied, cut == Cut::kAfterCommit);
    EXPECT_EQ(Received(*hulls_, id), 10);
    EXPECT_EQ(Received(*other, id), 10);
  }
}

// The transaction holds the lock and its COMMIT is in flight. A query of its outcome waits for the
// lock.
TEST_F(PostgresSharedFault, ALateCommitIsAwaited) {
  Start();
  const Server other = StartPeer();
  auto put = PutAPointWhoseCommitIsHeld();
  proxy_->Deliver();
  const auto result = put.get();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(result->already_applied);
  EXPECT_EQ(proxy_->cuts(), 1);
  EXPECT_EQ(Received(*other, "h"), 9);
  EXPECT_EQ(Received(*hulls_, "h"), 9);
}

TEST_F(PostgresSharedFault, ALateCommitChangesNothing) {
  Start();
  const Server other = StartPeer();
  auto put = PutAPointWhoseCommitIsHeld();
  // The store does the same after ten seconds of silence.
  EndSessions("state = 'idle in transaction'");
  ASSERT_TRUE(put.get().ok());
  ASSERT_TRUE(other->Put("h", {{10, 9, 9}}, "v").ok());
  const std::string before = RunSql("SELECT s::text FROM hulld.store s").front();
  proxy_->Deliver();
  EXPECT_EQ(RunSql("SELECT s::text FROM hulld.store s").front(), before);
  EXPECT_EQ(Received(*hulls_, "h"), 10);
  EXPECT_EQ(Received(*other, "h"), 10);
}

TEST_F(PostgresSharedFault, ALateRequestForTheCommitLockChangesNothing) {
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  proxy_->CutNext(Cut::kHold);
  ASSERT_TRUE(hulls_->Put("h", {{9, 9, 9}}).ok());
  EXPECT_EQ(proxy_->cuts(), 1);
  const std::string before = RunSql("SELECT s::text FROM hulld.store s").front();
  proxy_->Deliver();
  EXPECT_EQ(RunSql("SELECT s::text FROM hulld.store s").front(), before);
  ASSERT_TRUE(other->Put("h", {{10, 9, 9}}, "v").ok());
  EXPECT_EQ(Received(*hulls_, "h"), 10);
}

// A repeated creation or deletion cannot be recognized as a repetition.
TEST_F(PostgresSharedFault, ACreationOrDeletionWithALostAnswerIsNotRepeated) {
  Start();
  const Server other = StartPeer();
  proxy_->CutNext(Cut::kAfterCommit);
  const auto created = hulls_->Create("h");
  EXPECT_TRUE(created.ok()) << created.status();
  proxy_->CutNext(Cut::kAfterCommit);
  const auto replaced = Replace(*hulls_, "h", CubeCorners(), created->hull.revision);
  EXPECT_TRUE(replaced.ok()) << replaced.status();
  proxy_->CutNext(Cut::kAfterCommit);
  const auto deleted = hulls_->Delete("h");
  EXPECT_TRUE(deleted.ok()) << deleted.status();
  EXPECT_EQ(proxy_->cuts(), 3);
  EXPECT_TRUE(absl::IsNotFound(other->View("h").status()));
}

// Simulates leftover sessions of killed servers.
TEST_F(PostgresSharedFault, AServerWaitsIfTheDatabaseHasNoFreeSessions) {
  for (const int room : {1, 3}) {
    const std::string role = absl::StrCat("narrow_", room);
    const std::string database = cluster().MakeDatabase();
    RunSql(absl::StrCat("CREATE ROLE ", role, " LOGIN PASSWORD 'narrow' CONNECTION LIMIT ", room));
    RunSql(absl::StrCat("ALTER DATABASE ", database, " OWNER TO ", role));
    options_.conninfo = absl::StrCat("host=", cluster().socket_directory(), " dbname=", database,
                                     " user=", role, " password=narrow");
    options_.retry_timeout = std::chrono::milliseconds(0);
    const absl::Status refused = Open().status();
    EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("too many connections"));
    AwaitNoSession(absl::StrCat("usename = '", role, "'"));
    bool has_waited = false;
    options_.should_stop = [&] {
      RunSql(absl::StrCat("ALTER ROLE ", role, " CONNECTION LIMIT -1"));
      has_waited = true;
      return false;
    };
    options_.retry_timeout = std::chrono::seconds(10);
    const auto opened = Open();
    EXPECT_TRUE(opened.ok()) << opened.status();
    EXPECT_TRUE(has_waited);
  }
}

TEST_F(PostgresSharedFault, AllServersContinueWhenTheDatabaseEndsTheirSessions) {
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  RunSql(
      "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database() "
      "AND pid <> pg_backend_pid()");
  ASSERT_TRUE(other->Put("h", {{9, 9, 9}}).ok());
  EXPECT_EQ(Received(*hulls_, "h"), 9);
}

// The database's clock may jump, so that the number of later batches decides, not the time.
TEST_F(PostgresSharedFault, AStartDropsKilledServers) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  RunSql("UPDATE hulld.store SET batch = 100000");
  RunSql("INSERT INTO hulld.servers VALUES ('killed', 30000), ('in doubt', 40000)");
  const Server other = StartPeer();
  EXPECT_THAT(RunSql("SELECT owner FROM hulld.servers WHERE owner IN ('killed', 'in doubt')"),
              ElementsAre("in doubt"));
}

TEST_F(PostgresSharedFault, ARestoredDatabaseIsADifferentStoreForAllServers) {
  Start();
  const Server other = StartPeer();
  const std::string id = hulls_->store().id();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  EXPECT_EQ(Received(*other, "h"), 8);
  bool ended = false;
  hulls_->store().OnEnded([&] { ended = true; });
  RunSql("UPDATE hulld.store SET batch = batch - 1");
  EXPECT_TRUE(absl::IsUnavailable(hulls_->Put("h", {{9, 9, 9}}).status()));
  EXPECT_TRUE(ended);
  // Now, at the latest, the peer detects the new ID.
  EXPECT_TRUE(absl::IsUnavailable(other->View("h").status()));
  Start();
  EXPECT_NE(hulls_->store().id(), id);
}

// A session that holds the commit lock: half of a batch has arrived, and nothing follows.
class StalledSession {
 public:
  explicit StalledSession(const std::string& conninfo) : session_(PQconnectdb(conninfo.c_str())) {
    EXPECT_EQ(PQstatus(session_), CONNECTION_OK) << PQerrorMessage(session_);
    EXPECT_EQ(PQenterPipelineMode(session_), 1);
    for (const char* statement : {"BEGIN", "SELECT batch FROM hulld.store FOR UPDATE"}) {
      EXPECT_EQ(PQsendQueryParams(session_, statement, 0, nullptr, nullptr, nullptr, nullptr, 0),
                1);
    }
    EXPECT_EQ(PQsendFlushRequest(session_), 1);
    EXPECT_EQ(PQflush(session_), 0);
    // The session holds the lock after both answers; each answer ends with a null.
    for (int answers = 0; answers < 2;) {
      PGresult* const result = PQgetResult(session_);
      if (result == nullptr) ++answers;
      PQclear(result);
    }
  }
  ~StalledSession() { PQfinish(session_); }
  StalledSession(const StalledSession&) = delete;
  StalledSession& operator=(const StalledSession&) = delete;

 private:
  PGconn* const session_;
};

TEST_F(PostgresSharedFault, AServerStalledWithinABatchBlocksPeersOnlyBriefly) {
  options_.send_timeout = std::chrono::milliseconds(100);
  options_.heartbeat = std::chrono::milliseconds(50);
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const StalledSession stalled(cluster().Conninfo(database_, cluster().socket_directory()));
  EXPECT_TRUE(hulls_->Put("h", {{9, 9, 9}}).ok());
}

// The database's clock jumps by a day.
TEST_F(PostgresSharedFault, AStalledServerIsEndedWhateverTheClockOfTheDatabase) {
  const auto set_clock = [this](const std::string& time) {
    RunSql("ALTER FUNCTION pg_catalog.now() RENAME TO now_before");
    RunSql("CREATE FUNCTION pg_catalog.now() RETURNS timestamptz LANGUAGE sql AS 'SELECT " + time +
           "'");
  };
  options_.heartbeat = std::chrono::milliseconds(50);
  options_.send_timeout = std::chrono::milliseconds(100);
  Start();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  const std::string conninfo = cluster().Conninfo(database_, cluster().socket_directory());
  {
    set_clock("clock_timestamp() - interval ''1 day''");
    const StalledSession stalled(conninfo);
    EXPECT_TRUE(hulls_->Put("h", {{9, 9, 9}}).ok());
  }
  // A server that may still send the rest of its batch keeps the lock.
  options_.send_timeout = std::chrono::hours(1);
  options_.lock_timeout = std::chrono::milliseconds(500);
  Start();
  RunSql("DROP FUNCTION pg_catalog.now()");
  RunSql("ALTER FUNCTION pg_catalog.now_before() RENAME TO now");
  set_clock("clock_timestamp() + interval ''1 day''");
  const StalledSession slow(conninfo);
  EXPECT_TRUE(absl::IsUnavailable(hulls_->Put("h", {{-9, 9, 9}}).status()));
}

TEST_F(PostgresSharedFault, AServerTooFarBehindStops) {
  Start();
  const Server other = StartPeer();
  ASSERT_TRUE(hulls_->Put("h", CubeCorners()).ok());
  options_.poll_interval = std::chrono::hours(1);
  bool ended = false;
  hulls_->store().OnEnded([&] { ended = true; });
  RunSql("UPDATE hulld.store SET batch = batch + 1, pruned = batch + 1");
  EXPECT_TRUE(absl::IsUnavailable(hulls_->View("h").status()));
  EXPECT_TRUE(ended);
}

}  // namespace postgres_shared_fault_test
}  // namespace hulld::server
