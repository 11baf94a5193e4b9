#ifndef HULLD_SERVER_STORE_POSTGRES_POSTGRES_STORE_H_
#define HULLD_SERVER_STORE_POSTGRES_POSTGRES_STORE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/store/postgres/batch_notices.h"
#include "server/store/postgres/session.h"
#include "server/store/store.h"

namespace hulld::server {

// Pauses between attempts to reach the database. The pause doubles from the first value to the
// longest.
inline constexpr std::chrono::milliseconds kFirstRetryPause{10};
inline constexpr std::chrono::milliseconds kLongestRetryPause{500};

struct PostgresOptions {
  // The setting that names the file with the connection string, for error messages.
  static constexpr char kSetting[] = "--postgres-conninfo-file";

  // A connection string of libpq.
  std::string conninfo;
  // Replaces the active server instead of waiting for it to exit.
  bool take_over = false;
  // Also opens a store with an unfinished migration. Commits are on disk, regardless of the role's
  // default.
  bool migrating = false;
  // The source of a migration: opens only a database that contains a store. Commits are on disk,
  // too.
  bool must_exist = false;
  // Other servers may be active over the same database. Cannot be combined with take_over.
  bool shared = false;
  // Polled while this waits for the active server or for sessions; may be empty.
  std::function<bool()> should_stop;
  // Maximum wait of a statement for a lock.
  std::chrono::milliseconds lock_timeout{15'000};
  // Maximum silence of the database while an answer is due. Longer than lock_timeout.
  std::chrono::milliseconds answer_timeout{30'000};
  // Time limit for a commit that lost its session to determine its outcome or to retry, and for
  // Open to open the sessions after the first.
  std::chrono::milliseconds retry_timeout{10'000};
  // Interval at which this server checks that it is still active. The database considers the server
  // dead ten intervals after its last check.
  std::chrono::milliseconds heartbeat{1000};
  // Shared: true if servers notify each other of their batches (BatchNotices).
  bool notices = true;
  // Shared: interval of polling for commits of peer servers without notices; with notices, it is
  // one heartbeat.
  std::chrono::milliseconds poll_interval{100};
  // Shared: maximum time that a session may hold the commit lock while the database waits for the
  // rest of its batch, for example because its server stalls. The session is then ended.
  std::chrono::milliseconds send_timeout{30'000};
};

// Stores hulls in the schema "hulld" of a PostgreSQL database (14 or later); see postgres_open.cc
// for its tables. Their rows contain the same values as the RocksDB store, sealed with the same
// keys.
//
// Unless shared, any number of servers may be started over one database; one is active, the rest
// wait in Open. The active server holds an advisory lock in a dedicated session. The session ends
// with the server, or soon after the server stalls. The lock only decides the order of servers.
// Safety comes from the epoch in the row of the store. Each server raises it when it becomes
// active. Every transaction of a batch writes its own epoch next to it, and a table constraint
// rejects a mismatch. So a superseded server cannot commit anything, even if it has not noticed,
// and neither can packets that arrive late.
//
// A batch of changes is one transaction, sent in one message. If the session is lost before the
// outcome is known, the store raises the epoch again in a new session. This waits for the
// transaction if it is still running, and prevents a later commit, so the number of batches then
// shows whether it was committed. No caller is answered before that.
//
// If shared, several servers are active concurrently (postgres_shared.cc). They share the advisory
// lock and belong to one epoch, so that they cannot run alongside a server that requires exclusive
// access. A transaction first takes the commit lock, the lock of the store's row. It then reads the
// commits of peer servers that this server has not seen, and numbers its revisions after theirs.
// Changes to IDs that peer servers changed are skipped, and the registry retries them. The
// committing server notifies its peers (BatchNotices), which also poll. COMMIT is sent only by a
// session that holds the commit lock, so none can arrive after the lock was released; a server that
// lost the answer looks for its batch after it has acquired the lock again.
class PostgresStore : public Store, public PeerFeed {
 public:
  // Waits while another server is active, unless take_over. Creates the schema if it is missing.
  // INVALID_ARGUMENT: no connection string. FAILED_PRECONDITION: the schema is in another format,
  // or the database is too old. NOT_FOUND: must_exist, and there is no schema. CANCELLED:
  // should_stop returned true. DATA_LOSS: the row of the store is missing. UNAVAILABLE: it cannot
  // connect, or lacks a required permission.
  static absl::StatusOr<std::unique_ptr<PostgresStore>> Open(PostgresOptions options);

  ~PostgresStore() override;

  std::string kind() const override { return "postgres"; }
  const std::string& id() const override { return id_; }
  // Determined by synchronous_commit when the store was opened; the sessions keep that value.
  Durability durability() const override { return durability_; }
  bool keeps_hulls() const override { return true; }
  uint64_t revision() const override { return revision_; }
  PeerFeed* peers() override { return options_.shared ? this : nullptr; }
  absl::Status Fetch() override;
  void StartFetch() override;
  PeerChanges TakeChanges() override { return std::exchange(peer_changes_, {}); }
  std::vector<std::optional<std::vector<Vector>>> LoadGrowth(
      std::span<const HullGrowth> hulls) override;
  void OnPeerCommit(std::function<void()> committed) override;
  bool supports_lookup() const override { return true; }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override;
  absl::StatusOr<FoundRecords> ListRecords(const std::string& prefix, const std::string& after,
                                           size_t limit, RecordKinds kinds) override;
  StoreTotals totals() const override { return totals_; }
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override;
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override;
  absl::StatusOr<std::vector<WriterSequence>> LoadWriters(const StoredHull& hull) override;
  absl::Status Commit(std::span<Change* const> changes) override;
  absl::Status Recover() override;
  StoreFailures failures() const override {
    return {.write = write_failures_.load(std::memory_order_relaxed),
            .sync = 0,
            .read = read_failures_.load(std::memory_order_relaxed)};
  }
  std::optional<StoreDisk> disk() const override;
  absl::StatusOr<std::string> MakeCopy() override;
  void OnEnded(std::function<void()> ended) override;

  // Version of the tables. A store in any other format is refused.
  static constexpr uint64_t kFormat = 4;
  // The epoch of this server, which only grows.
  uint64_t epoch() const { return epoch_.load(); }

  // For a migration: the session that commits, and the statement that fences a transaction, sets
  // the store's revision, and adds `added` to its totals.
  Session& writer() { return *writer_; }
  Statement Fence(uint64_t revision, const StoreTotals& added) const {
    return Fence({batch_, revision, added});
  }

 private:
  // Owner of a shared store.
  static constexpr char kSeveralServers[] = "several servers";
  // The state after the batch in flight, if it commits; number 0: no batch was sent.
  struct Batch {
    uint64_t number = 0;
    uint64_t revision = 0;
    // Change of the totals, modulo 2^64.
    StoreTotals added = {};
  };

  PostgresStore(PostgresOptions options, Conninfo conninfo);

  // Owner of the store while this is active.
  std::string store_owner() const { return options_.shared ? kSeveralServers : owner_; }

  absl::StatusOr<std::unique_ptr<Session>> OpenSession(const std::string& settings) const;
  absl::StatusOr<std::unique_ptr<Session>> OpenWriter() const;
  absl::StatusOr<std::unique_ptr<Session>> OpenReader() const;
  absl::StatusOr<std::unique_ptr<Session>> OpenKeeper() const;
  absl::StatusOr<std::unique_ptr<Session>> OpenListener() const;

  // Opens the store by the following steps, in this order.
  absl::Status BecomeActive();
  absl::Status CheckServer(Session& session);
  absl::Status WaitForTurn();
  absl::Status MakeSchema(Session& session);
  absl::Status BeginWithRetries();
  absl::Status RenewWriter();
  absl::StatusOr<Rows> Claim(Statement claim);
  absl::Status Begin();
  absl::Status OpenFirstReaders();

  // Becoming and staying active.
  absl::StatusOr<bool> CheckFormat(Session& session) const;
  absl::StatusOr<bool> TryLock(Session& session) const;
  absl::StatusOr<std::string> Owner(Session& session) const;
  void RunKeeper();
  absl::Status CheckActive();
  absl::Status MeasureDisk();
  void End(const absl::Status& reason);
  // Returns the reason that this is not the active server. owner: the active server, if known.
  static absl::Status Superseded(std::string_view owner);
  absl::Status ended() const;

  // Committing. batch: its number.
  Statement Fence(const Batch& batch) const;
  absl::Status Attempt(std::span<Change* const> changes, Batch* batch);
  absl::Status SendBatch(std::vector<Statement> statements, const Batch& batch);
  void EndTransaction(const absl::Status& status);
  void NoteCommitted(const Batch& batch);
  absl::StatusOr<bool> FindOutcome(uint64_t batch, std::chrono::steady_clock::time_point deadline);
  bool AwaitEnd(std::chrono::milliseconds pause);
  absl::StatusOr<bool> Reclaim(uint64_t batch);
  absl::StatusOr<bool> OutcomeBeforePeers(uint64_t batch);
  absl::Status WriteFailed(const absl::Status& status);
  absl::Status OutcomeUnknown(const absl::Status& cause) const;
  static absl::Status Refused(const absl::Status& cause);
  void EndRelaxedRun();

  // For a shared store.
  static std::string PrepareFetch();
  static std::string PrepareShared();
  absl::Status MakeSharedSchema(Session& session);
  absl::Status Join();
  void Leave();
  absl::Status CheckStore(const Rows& rows);
  void AssignNewId();
  absl::Status NotePeerChanges(const Rows& rows);
  absl::Status AttemptShared(std::span<Change* const> changes, Batch* batch);
  absl::StatusOr<bool> SharedOutcome(uint64_t batch);
  absl::Status EndStuckTransactions();
  void StartNotices();
  bool ReceivesNotices() const;
  absl::Status PollPeers();
  void NotifyPeerCommit();
  static absl::Status CheckRecord(const HullRecord& hull, const Rows& rows);
  absl::Status ExplainDamage(const StoredHull& hull, const absl::Status& damage);

  // Return the results of statements that ran while this was the active server.
  absl::StatusOr<std::vector<Rows>> Read(std::vector<Statement> statements);
  absl::StatusOr<Rows> ReadOne(Statement statement);

  const PostgresOptions options_;
  const Conninfo conninfo_;
  // This server's name in the database: unique, and identifies the process to an operator.
  const std::string owner_;
  std::string id_;
  uint64_t revision_ = 0;
  // Totals at that revision.
  StoreTotals totals_;
  Durability durability_ = Durability::kSync;
  // The value of synchronous_commit.
  std::string synchronous_commit_;
  std::atomic<uint64_t> epoch_ = 0;

  // For Commit, Recover, and shutdown, which never overlap.
  std::unique_ptr<Session> writer_;
  // Number of committed batches, as far as is known. Read by the keeper and the notices, too.
  std::atomic<uint64_t> batch_ = 0;
  // Shared: the changes of peer servers up to that batch that TakeChanges has not returned yet.
  PeerChanges peer_changes_;
  // Shared: a started query for Fetch to finish; null: it must send one.
  std::unique_ptr<Session> fetching_;
  // True if the database has lost batches.
  bool has_lost_batches_ = false;
  // Not OK: the outcome of batch_ + 1 is unknown.
  absl::Status unknown_;

  SessionPool readers_;
  // For a shared store: a separate pool, so that read barriers do not wait for readers.
  SessionPool follower_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  bool ending_ = false;
  absl::Status ended_;
  std::function<void()> on_ended_;
  std::function<void()> on_peer_commit_;
  std::optional<StoreDisk> disk_;

  std::atomic<uint64_t> write_failures_ = 0;
  std::atomic<uint64_t> read_failures_ = 0;

  // Used only by the keeper while it runs.
  std::unique_ptr<Session> keeper_session_;
  bool has_lock_ = false;
  // Shared: the sessions that EndStuckTransactions watches, by process and time of their last
  // change of state, and when it first found them in this state.
  std::map<std::string, std::chrono::steady_clock::time_point> stalled_since_;
  // Shared: the last batch found by the keeper.
  uint64_t polled_batch_ = 0;
  // Shared: created before the keeper starts.
  std::unique_ptr<BatchNotices> notices_;
  std::thread keeper_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_POSTGRES_STORE_H_
