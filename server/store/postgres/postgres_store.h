#ifndef HULLD_SERVER_STORE_POSTGRES_POSTGRES_STORE_H_
#define HULLD_SERVER_STORE_POSTGRES_POSTGRES_STORE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/store/postgres/batch_notices.h"
#include "server/store/postgres/conninfo.h"
#include "server/store/postgres/session.h"
#include "server/store/postgres/session_pool.h"
#include "server/store/store.h"

namespace hulld::server {

struct PostgresOptions {
  // A connection string of libpq.
  std::string conninfo;
  // The setting that names it, for what is told when the store cannot be opened.
  std::string setting = "--postgres-conninfo-file";
  // Takes the store from the server that is active, instead of waiting for its end.
  bool take_over = false;
  // Opens a store that a migration has not finished, too.
  bool migrating = false;
  // Other servers may be active over the same database. Not with take_over.
  bool shared = false;
  // Which slots of IDs this database holds, as a text that is the same for the same slots; empty:
  // all. The database remembers it once it is opened with some.
  std::string slots;
  // Asked while this waits for the active server, or for one that changes the tables, or changes
  // them; may be empty.
  std::function<bool()> should_stop;
  // How long a statement waits for a lock.
  std::chrono::milliseconds lock_time{15'000};
  // How long nothing may come from the database while an answer is due. Longer than lock_time.
  std::chrono::milliseconds answer_time{30'000};
  // How long a commit tries to find out what became of it, or to repeat what did not happen, when
  // it has lost its session; and how long Open tries to get the sessions after the first.
  std::chrono::milliseconds patience{10'000};
  // How often this looks whether it is still the active server, and the database whether this is
  // still there: ten times that after the last look.
  std::chrono::milliseconds beat{1000};
  // Shared: whether servers tell each other of their batches (BatchNotices).
  bool notices = true;
  // Shared: how often this looks whether other servers committed, where they do not tell; with
  // each beat where they do.
  std::chrono::milliseconds look{100};
  // Shared: how long a session may hold the turn while the database waits for the rest of its
  // batch, as when its server stands still. It is ended then.
  std::chrono::milliseconds longest_send{30'000};
};

// Keeps hulls in the schema "hulld" of a PostgreSQL database (14 or later); see postgres_open.cc
// for its tables. Their rows hold the same values, sealed with the same keys, as the RocksDB store.
//
// Unless it is shared, any number of servers may be started over one database; one is active, the
// others wait in Open. The active one holds an advisory lock in a session of its own, which ends
// with it, or soon after it stands still. That lock is for order alone. What keeps two servers
// apart is the epoch in the row of the store, which each server raises when it becomes active:
// every transaction of a batch writes the epoch that it belongs to beside it, and a constraint of
// the table refuses another. So a server that was superseded can commit nothing, whatever it
// believes, and neither can what a network delivers late.
//
// A batch of changes is one transaction, sent in one piece. When the session is lost before its
// outcome is known, the store raises the epoch again, in a new session: that waits for the
// transaction if it is still there, and nothing of it can follow. How many batches there were then
// tells whether it was committed. Nobody is told anything before.
//
// Shared, several servers are active at once (postgres_shared.cc). They hold the same advisory lock
// together and belong to one epoch, so that they and a server that is active alone shut each other
// out. A transaction takes the turn first, which is the lock of the row of the store, and is told
// what others committed since this server knew of it; its revisions are the next after those.
// Changes of IDs that others changed are left out, and made anew by the registry. The server that
// commits tells the others to look (BatchNotices), and they look now and then as well. COMMIT is
// sent only by a session that was given the turn, so none can arrive after the turn went on; a
// server that lost the answer finds its batch, or does not, once it has the turn again.
class PostgresStore : public Store {
 public:
  // Waits while another server is active, unless take_over. Makes the schema where there is none.
  // INVALID_ARGUMENT: no connection string. FAILED_PRECONDITION: a newer hulld made the schema, or
  // the database is too old. CANCELLED: should_stop said so. DATA_LOSS: the row of the store is not
  // there. UNAVAILABLE: it cannot connect, or may not do what it must. FAILED_PRECONDITION also:
  // the database holds other slots.
  static absl::StatusOr<std::unique_ptr<PostgresStore>> Open(PostgresOptions options);

  ~PostgresStore() override;

  std::string kind() const override { return "postgres"; }
  std::string id() const override { return id_; }
  // As synchronous_commit was for our sessions when this was opened, which they keep.
  Durability durability() const override { return durability_; }
  bool keeps_hulls() const override { return true; }
  uint64_t revision() const override { return revision_; }
  bool is_shared() const override { return options_.shared; }
  absl::Status Follow() override;
  void StartFollow() override;
  OtherChanges TakeOthers() override { return std::exchange(others_, {}); }
  absl::Status HoldOthers() override;
  bool ReleaseOthers() override;
  std::vector<std::optional<std::vector<Vector>>> LoadGrowth(
      std::span<const HullGrowth> hulls) override;
  void OnOthers(std::function<void()> others) override;
  absl::Status ForEachHull(const StoredHullVisitor& visit) override;
  absl::Status ForEachBody(const StoredBodyVisitor& visit) override;
  bool finds_records() const override { return true; }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override;
  absl::StatusOr<FoundRecords> ListRecords(const std::string& prefix, const std::string& after,
                                           size_t most, RecordKinds kinds) override;
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

  // The version of the tables. Format 2 knows slots, format 3 how many hulls and vertices
  // the store holds, format 4 how many bodies, too.
  static constexpr uint64_t kFormat = 4;
  // The epoch of this server, which only grows.
  uint64_t epoch() const { return epoch_.load(); }

 private:
  // The owner of a store that is shared.
  static constexpr char kSeveralServers[] = "several servers";
  // A batch as it is to be when it is committed; number 0: none was sent.
  struct SharedBatch {
    uint64_t number = 0;
    uint64_t revision = 0;
    // What it adds to the totals, modulo 2^64.
    StoreTotals added = {};
  };

  PostgresStore(PostgresOptions options, Conninfo conninfo);

  // The owner of the store while this is active.
  std::string store_owner() const { return options_.shared ? kSeveralServers : owner_; }

  absl::StatusOr<std::unique_ptr<Session>> OpenSession(const std::string& settings) const;
  absl::StatusOr<std::unique_ptr<Session>> OpenWriter() const;
  absl::StatusOr<std::unique_ptr<Session>> OpenReader() const;
  absl::StatusOr<std::unique_ptr<Session>> OpenKeeper() const;
  absl::StatusOr<std::unique_ptr<Session>> OpenListener() const;

  // Opening, in this order.
  absl::Status CheckServer(Session& session);
  absl::StatusOr<Rows> RunPatiently(Session& session, const std::string& sql) const;
  absl::Status WaitForTurn();
  absl::Status MakeSchema(Session& session);
  absl::Status MakeTables(Session& session);
  absl::Status AddTotals(Session& session) const;
  absl::StatusOr<bool> CheckSlots(Session& session);
  absl::Status CheckIsEmpty(Session& session);
  absl::Status TakeSlots(Session& session);
  absl::Status BeginPatiently();
  absl::Status Begin();
  absl::Status OpenFirstReaders();

  // Becoming active, and staying so.
  absl::StatusOr<bool> CheckFormat(Session& session) const;
  absl::StatusOr<bool> TryLock(Session& session) const;
  absl::StatusOr<std::string> Owner(Session& session) const;
  void Keep();
  absl::Status Beat();
  absl::Status MeasureDisk();
  void End(const absl::Status& reason);
  // Why this is not the active server. owner: which is, if that is known.
  static absl::Status Superseded(std::string_view owner);
  absl::Status ended() const;

  // Committing. batch: its number.
  Statement Fence(uint64_t revision, uint64_t batch, const StoreTotals& added) const;
  absl::Status Attempt(std::span<const Change* const> changes, uint64_t revision, uint64_t batch);
  absl::StatusOr<bool> FindOutcome(uint64_t batch, std::chrono::steady_clock::time_point deadline);
  absl::StatusOr<bool> Reclaim(uint64_t batch);
  absl::StatusOr<bool> OutcomeBeforeOthers(uint64_t batch);
  absl::Status WriteFailed(const absl::Status& status);
  absl::Status OutcomeUnknown(const absl::Status& cause) const;
  static absl::Status Refused(const absl::Status& cause);
  void EndRelaxedRun();

  // Shared.
  static std::string PrepareFollow();
  static std::string PrepareShared();
  absl::Status MakeSharedSchema(Session& session);
  absl::Status Join();
  void Leave();
  absl::Status CheckStore(const Rows& rows);
  void GiveNewId();
  absl::Status NoteOthers(const Rows& rows);
  absl::Status CommitShared(std::span<Change* const> changes);
  absl::Status TakeTurn();
  void GiveTurnBack(const absl::Status& status);
  absl::Status AttemptShared(std::span<Change* const> changes, SharedBatch* batch);
  void KeepShared(const SharedBatch& batch);
  absl::StatusOr<bool> SharedOutcome(uint64_t batch);
  absl::StatusOr<bool> FindSharedOutcome(uint64_t batch,
                                         std::chrono::steady_clock::time_point deadline);
  absl::Status EndStuckTurns();
  void StartNotices();
  bool HearsOthers() const;
  absl::Status LookForOthers();
  void TellOfOthers();
  absl::StatusOr<std::string> ReadSequence(const HullRecord& hull, const std::string& writer_id);
  absl::Status WhyDamaged(const StoredHull& hull, const absl::Status& damage);

  // Every row of a table, in byte order of the IDs: its ID and its sealed value.
  absl::Status ForEachRow(const char* statement,
                          const std::function<void(const std::string&, std::string_view)>& visit);
  // The answers to statements, asked while this was the active server.
  absl::StatusOr<std::vector<Rows>> Read(std::vector<Statement> statements);

  const PostgresOptions options_;
  const Conninfo conninfo_;
  // Our name in the database: unique, and tells an operator which process it is.
  const std::string owner_;
  std::string id_;
  uint64_t revision_ = 0;
  // The totals as of that revision.
  StoreTotals totals_;
  Durability durability_ = Durability::kSync;
  // The value of synchronous_commit.
  std::string synchronous_commit_;
  std::atomic<uint64_t> epoch_ = 0;

  // Commit, Recover and the end, which come one at a time.
  std::unique_ptr<Session> writer_;
  // Batches that are committed, as far as is known.
  uint64_t batch_ = 0;
  // Shared: batch_, for the keeper; and what others did up to it that nobody asked for yet.
  std::atomic<uint64_t> seen_batch_ = 0;
  OtherChanges others_;
  // Shared: what Follow is to take the answer from; null: it has to ask.
  std::unique_ptr<Session> following_;
  // The database was found to have lost batches.
  bool went_back_ = false;
  // Set: what became of batch_ + 1 is not known.
  absl::Status unknown_;

  SessionPool readers_;
  // For a shared store: a pool of its own, so that calls that wait to know what others did do not
  // wait for readers.
  SessionPool follower_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  bool ending_ = false;
  absl::Status ended_;
  std::function<void()> on_ended_;
  std::function<void()> on_others_;
  std::optional<StoreDisk> disk_;

  std::atomic<uint64_t> write_failures_ = 0;
  std::atomic<uint64_t> read_failures_ = 0;

  // The keeper's own, once it runs.
  std::unique_ptr<Session> keeper_session_;
  bool has_lock_ = false;
  // Shared: the last batch that the keeper found.
  uint64_t looked_at_ = 0;
  // Shared: made before the keeper starts.
  std::unique_ptr<BatchNotices> notices_;
  std::thread keeper_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_POSTGRES_STORE_H_
