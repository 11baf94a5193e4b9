// The claim of the active server, commits with their outcome, and shutdown.
#include "server/store/postgres/postgres_store.h"

#include <absl/status/status.h>
#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/process/random_id.h"
#include "server/store/postgres/batch_statements.h"
#include "server/store/store_errors.h"

namespace hulld::server {
namespace {

// Key of the active server's advisory lock within its database: "hulld" as a number.
constexpr uint64_t kLock = 0x68756c6c64;
constexpr int kHeartbeatsPerMeasure = 10;

using Clock = std::chrono::steady_clock;

}  // namespace

// Returns true if the tables exist. FAILED_PRECONDITION: they are in another format.
absl::StatusOr<bool> PostgresStore::CheckFormat(Session& session) const {
  const absl::StatusOr<bool> exists = HasTable(session, "hulld.store");
  if (!exists.ok() || !*exists) return exists;
  HULLD_ASSIGN_OR_RETURN(const uint64_t number,
                         SingleNumber(session.Run("SELECT format FROM hulld.store")));
  if (number != kFormat) return OtherFormat("the store", number, kFormat);
  const absl::StatusOr<bool> is_marked = HasTable(session, "hulld.migration");
  if (!is_marked.ok()) return is_marked;
  if (options_.migrating || !*is_marked) return true;
  return UnfinishedMigration();
}

absl::StatusOr<bool> PostgresStore::TryLock(Session& session) const {
  const char* const lock = options_.shared ? "pg_try_advisory_lock_shared" : "pg_try_advisory_lock";
  HULLD_ASSIGN_OR_RETURN(const Rows locked,
                         session.Run(absl::StrCat("SELECT ", lock, "(", kLock, ")")));
  return locked.at(0, 0) == "t";
}

absl::StatusOr<std::string> PostgresStore::Owner(Session& session) const {
  HULLD_ASSIGN_OR_RETURN(const Rows owner, session.Run("SELECT owner FROM hulld.store"));
  return owner.count() == 0 ? "" : std::string(owner.at(0, 0));
}

absl::Status PostgresStore::Superseded(std::string_view owner) {
  return Unavailable("another hulld took over the store", owner.empty() ? "" : " (",
                     std::string(owner), owner.empty() ? "" : ")",
                     ": this server exits without changing anything; connect to the other one");
}

void PostgresStore::RunKeeper() {
  bool failing = false;
  int silent_heartbeats = 0;
  bool reported_silence = false;
  std::unique_lock lock(mutex_);
  const auto period =
      options_.shared ? std::min(options_.poll_interval, options_.heartbeat) : options_.heartbeat;
  const int64_t polls_per_heartbeat = options_.heartbeat / period;
  for (int64_t poll = 1; !wake_.wait_for(lock, period, [this] { return ending_; }); ++poll) {
    const bool is_heartbeat = poll % polls_per_heartbeat == 0;
    // Retries an unreachable database only once per heartbeat.
    if (keeper_session_ == nullptr && !is_heartbeat) continue;
    lock.unlock();
    if (is_heartbeat) {
      const bool is_silent = notices_ != nullptr && notices_->is_listening() && !ReceivesNotices();
      silent_heartbeats = is_silent ? silent_heartbeats + 1 : 0;
      reported_silence = reported_silence && is_silent;
    }
    // Two heartbeats without the expected notice are not a coincidence.
    if (silent_heartbeats == 2 && !std::exchange(reported_silence, true)) {
      spdlog::warn(
          "no commit notices are arriving although the listening session is open; polling the "
          "database every {} ms until one arrives",
          options_.poll_interval.count());
    }
    absl::Status status;
    if (is_heartbeat) status = CheckActive();
    if (status.ok() && is_heartbeat && options_.shared) status = EndStuckTransactions();
    if (status.ok() && options_.shared && (is_heartbeat || !ReceivesNotices())) {
      status = PollPeers();
    }
    if (status.ok() && poll % (polls_per_heartbeat * kHeartbeatsPerMeasure) == 0)
      status = MeasureDisk();
    if (!status.ok()) {
      keeper_session_ = nullptr;
      has_lock_ = false;
    }
    if (!status.ok() && !failing) {
      spdlog::error("cannot verify with the database that this server is active: {}",
                    std::string(status.message()));
    }
    if (status.ok() && failing) spdlog::warn("the database responds again");
    failing = !status.ok();
    lock.lock();
    if (!ended_.ok()) return;
  }
}

absl::Status PostgresStore::CheckActive() {
  if (keeper_session_ == nullptr) {
    HULLD_ASSIGN_OR_RETURN(keeper_session_, OpenKeeper());
  }
  HULLD_ASSIGN_OR_RETURN(const std::string owner, Owner(*keeper_session_));
  if (owner != store_owner()) {
    End(Superseded(owner));
    return absl::OkStatus();
  }
  if (has_lock_) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(has_lock_, TryLock(*keeper_session_));
  return absl::OkStatus();
}

// Measures the size of the tables, if the role permits it.
absl::Status PostgresStore::MeasureDisk() {
  HULLD_ASSIGN_OR_RETURN(
      const Rows size,
      keeper_session_->Run("SELECT sum(pg_total_relation_size(oid)) FROM pg_class "
                           "WHERE relnamespace = 'hulld'::regnamespace AND relkind = 'r'"));
  StoreDisk disk;
  if (size.count() != 1 || !absl::SimpleAtoi(std::string(size.at(0, 0)), &disk.bytes)) {
    return absl::OkStatus();
  }
  const std::lock_guard lock(mutex_);
  disk_ = disk;
  return absl::OkStatus();
}

std::optional<StoreDisk> PostgresStore::disk() const {
  const std::lock_guard lock(mutex_);
  return disk_;
}

// Ends this store permanently: it is no longer the active server.
void PostgresStore::End(const absl::Status& reason) {
  std::function<void()> on_ended;
  {
    const std::lock_guard lock(mutex_);
    if (!ended_.ok()) return;
    ended_ = reason;
    on_ended = on_ended_;
  }
  spdlog::critical("{}", std::string(reason.message()));
  if (on_ended) on_ended();
}

absl::Status PostgresStore::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

void PostgresStore::OnEnded(std::function<void()> ended) {
  {
    const std::lock_guard lock(mutex_);
    on_ended_ = ended;
    if (ended_.ok()) return;
  }
  ended();
}

absl::Status PostgresStore::OutcomeUnknown(const absl::Status& cause) const {
  return Unavailable("lost the database connection during COMMIT (", cause.message(),
                     "), and the outcome is still unknown: ",
                     options_.shared ? "the change may or may not be committed"
                                     : "the change is not visible, but may appear after a restart",
                     "; check whether it is there before you retry");
}

absl::Status PostgresStore::Refused(const absl::Status& cause) {
  absl::Status status(
      cause.code(),
      absl::StrCat("cannot write to the database (", cause.message(),
                   "); nothing was changed; fix the cause, then retry; no restart is needed"));
  cause.ForEachPayload(
      [&](absl::string_view name, const absl::Cord& payload) { status.SetPayload(name, payload); });
  return status;
}

PostgresStore::~PostgresStore() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  if (keeper_.joinable()) keeper_.join();
  notices_ = nullptr;
  if (durability_ == Durability::kRelaxed && ended().ok()) EndRelaxedRun();
  if (options_.shared) Leave();
  // Unlocks explicitly, so that a waiting server need not wait until the database notices the
  // closed session.
  if (has_lock_) keeper_session_->Run("SELECT pg_advisory_unlock_all()").status().IgnoreError();
}

// The sync of this statement covers earlier commits. If it fails, the mark stays.
void PostgresStore::EndRelaxedRun() {
  if (writer_ == nullptr || !writer_->Run("SET synchronous_commit = on").ok()) return;
  writer_->Execute({.name = "hulld_close", .parameters = {EncodeBigint(epoch())}})
      .status()
      .IgnoreError();
}

absl::Status PostgresStore::WriteFailed(const absl::Status& status) {
  ++write_failures_;
  return status;
}

// Writes the revision, the batch number and the resulting totals, if this server's epoch is still
// current.
Statement PostgresStore::Fence(const Batch& batch) const {
  return {.name = "hulld_fence",
          .parameters = {EncodeBigint(batch.revision), EncodeBigint(batch.number),
                         EncodeBigint(epoch()), EncodeBigint(batch.added.hulls),
                         EncodeBigint(batch.added.vertices), EncodeBigint(batch.added.bodies)}};
}

// Runs one transaction. If the session is lost, it may have been committed; after other errors it
// was not. batch: set before anything is sent that may commit it.
absl::Status PostgresStore::Attempt(std::span<Change* const> changes, Batch* batch) {
  *batch = {batch_ + 1, NumberChanges(changes, revision_), AddedBy(changes)};
  // The fence runs first, so that a superseded server writes nothing.
  std::vector<Statement> statements = {{.text = "BEGIN"}, Fence(*batch)};
  std::ranges::move(StatementsOf(changes), std::back_inserter(statements));
  return SendBatch(std::move(statements), *batch);
}

// Sends the last statements of a transaction, and COMMIT.
absl::Status PostgresStore::SendBatch(std::vector<Statement> statements, const Batch& batch) {
  statements.push_back({.text = "COMMIT"});
  const absl::Status status = writer_->ExecuteCommit(statements).status();
  if (status.ok()) {
    NoteCommitted(batch);
  } else {
    EndTransaction(status);
  }
  return status;
}

// Ends a transaction that was not committed, for this status. A failed transaction cannot be
// committed, and ends with its session at the latest.
void PostgresStore::EndTransaction(const absl::Status& status) {
  if (IsLost(status) || !writer_->Run("ROLLBACK").ok()) writer_ = nullptr;
  if (has_lost_batches_) AssignNewId();
}

// Returns true if the batch was committed. UNAVAILABLE: unknown at the deadline.
absl::StatusOr<bool> PostgresStore::FindOutcome(uint64_t batch, Clock::time_point deadline) {
  for (auto pause = kFirstRetryPause;; pause = std::min(2 * pause, kLongestRetryPause)) {
    const absl::StatusOr<bool> outcome = options_.shared ? SharedOutcome(batch) : Reclaim(batch);
    if (outcome.ok()) return outcome;
    writer_ = nullptr;
    if (options_.shared && ViolatedConstraint(outcome.status()) == "store_fence") {
      End(Superseded(""));
    }
    // A server that is the only active one can determine the outcome even after it was superseded.
    if (options_.shared && !ended().ok()) return outcome;
    if (Clock::now() + pause >= deadline || AwaitEnd(pause)) return outcome;
  }
}

// Waits; returns true if this server ends during the wait.
bool PostgresStore::AwaitEnd(std::chrono::milliseconds pause) {
  std::unique_lock lock(mutex_);
  return wake_.wait_for(lock, pause, [this] { return ending_; });
}

// Records a committed batch.
void PostgresStore::NoteCommitted(const Batch& batch) {
  batch_ = batch.number;
  revision_ = batch.revision;
  totals_ = {totals_.hulls + batch.added.hulls, totals_.vertices + batch.added.vertices,
             totals_.bodies + batch.added.bodies};
  if (notices_ != nullptr) notices_->Send(batch.number);
}

// Raises the epoch in a new session. This waits for the batch's transaction to end if it has locked
// the row, and fences it off otherwise. The sync covers earlier commits.
absl::StatusOr<bool> PostgresStore::Reclaim(uint64_t batch) {
  HULLD_RETURN_IF_ERROR(RenewWriter());
  const Statement reclaim = {.name = "hulld_reclaim", .parameters = {owner_}};
  HULLD_ASSIGN_OR_RETURN(const std::vector<Rows> rows,
                         writer_->ExecuteCommit(std::span(&reclaim, 1)));
  const Rows& claimed = rows.front();
  if (claimed.count() == 0) return OutcomeBeforePeers(batch);
  epoch_ = claimed.bigint(0, 0);
  const uint64_t found = claimed.bigint(0, 1);
  if (found >= batch_) return found >= batch;
  // The database lost acknowledged commits through an outage without sync or a restore of an
  // earlier state. It will assign their revisions to other changes, so this is now a different
  // store.
  HULLD_RETURN_IF_ERROR(
      writer_->Execute({.name = "hulld_rename", .parameters = {RandomId()}}).status());
  End(Unavailable("the database has lost ", batch_ - found,
                  " batches committed by this server (failover to a lagging standby, a restored "
                  "backup, or an outage with synchronous_commit = off); this server exits; after "
                  "a restart the remaining data is served under a new store ID"));
  return false;
}

// The first epoch after this server's records the number of batches at its start.
absl::StatusOr<bool> PostgresStore::OutcomeBeforePeers(uint64_t batch) {
  HULLD_ASSIGN_OR_RETURN(
      const Rows next,
      writer_->Execute({.name = "hulld_next_epoch", .parameters = {EncodeBigint(epoch())}}));
  if (next.count() == 0) {
    End(
        Unavailable("the database was restored to a state before this server became "
                    "active; this server exits"));
    return false;
  }
  End(Superseded(""));
  return next.bigint(0, 0) >= batch;
}

absl::Status PostgresStore::Commit(std::span<Change* const> changes) {
  HULLD_RETURN_IF_ERROR(ended());
  if (!unknown_.ok()) return unknown_;
  const Clock::time_point deadline = Clock::now() + options_.retry_timeout;
  for (auto pause = kFirstRetryPause;; pause = std::min(2 * pause, kLongestRetryPause)) {
    // The outcome of the previous session is known.
    absl::Status status = writer_ == nullptr ? RenewWriter() : absl::OkStatus();
    Batch batch;
    if (status.ok()) {
      status = options_.shared ? AttemptShared(changes, &batch) : Attempt(changes, &batch);
    }
    if (status.ok()) return status;
    if (ViolatedConstraint(status) == "store_fence") {
      End(Superseded(""));
      return WriteFailed(ended());
    }
    // A server that is active alone finds the outcome even after its end.
    const bool finds_outcome = batch.number != 0 && !options_.shared;
    if (absl::Status s = ended(); !s.ok() && !finds_outcome) return WriteFailed(s);
    // The database answered with an error, so the batch was not committed.
    if (!SqlState(status).empty()) return WriteFailed(Refused(status));
    if (batch.number != 0) {
      const absl::StatusOr<bool> committed = FindOutcome(batch.number, deadline);
      if (!committed.ok()) {
        const absl::Status unknown = OutcomeUnknown(status);
        // The next transaction of a shared store settles the outcome.
        if (!options_.shared) unknown_ = unknown;
        return WriteFailed(unknown);
      }
      spdlog::warn("lost the database connection during COMMIT ({}); the batch was {}",
                   std::string(status.message()), *committed ? "committed" : "not committed");
      if (*committed) {
        NoteCommitted(batch);
        return absl::OkStatus();
      }
      if (absl::Status s = ended(); !s.ok()) return WriteFailed(s);
    }
    if (Clock::now() + pause >= deadline || AwaitEnd(pause)) return WriteFailed(Refused(status));
  }
}

// Determines unknown outcomes. A refused batch that was committed after all cannot be undone, so
// the server that refused it ends, and the next one serves it.
absl::Status PostgresStore::Recover() {
  HULLD_RETURN_IF_ERROR(ended());
  if (unknown_.ok()) return absl::OkStatus();
  const absl::StatusOr<bool> committed = Reclaim(batch_ + 1);
  if (!committed.ok()) {
    writer_ = nullptr;
    ++write_failures_;
    return OutcomeUnknown(committed.status());
  }
  unknown_ = absl::OkStatus();
  if (*committed) {
    End(Unavailable(
        "the database committed changes whose outcome was reported as unknown; this server's "
        "memory is stale, so it exits; restart it to serve them"));
  }
  HULLD_RETURN_IF_ERROR(ended());
  spdlog::warn("the database accepts writes again");
  return absl::OkStatus();
}

absl::StatusOr<std::string> PostgresStore::MakeCopy() {
  return absl::FailedPreconditionError(
      "the store is PostgreSQL (--store=postgres); back it up with pg_dump --schema=hulld, or with "
      "pg_basebackup and WAL archiving");
}

}  // namespace hulld::server
