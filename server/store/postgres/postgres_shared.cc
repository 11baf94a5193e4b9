// Several active servers over one store: commits, and changes by peer servers.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/process/random_id.h"
#include "server/store/postgres/batch_statements.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

// Key of the advisory lock for creating the tables.
constexpr uint64_t kSchemaLock = 0x68756c6c65;
// Number of batches whose changes are retained for servers that have not read them yet, and number
// of batches between prunings of older changes.
constexpr uint64_t kKeptBatches = 1 << 16;
constexpr uint64_t kBatchesPerPruning = 1 << 10;
// Maximum number of changed IDs that a server applies as one. Applying this many took 0.2 s under
// the registry's mutex (**observed**, with hulls created and deleted in between, at load 6). They
// form one version for readers, so they cannot be applied in parts.
constexpr int kMaxFollowed = 1 << 17;

// hulld.changes lists the IDs changed by each batch, for peer servers: `revision` is the store's
// after the last change of the ID in the batch; `ended_at` is the revision at which an incarnation
// of it ended, or 0; `began` is the create_revision of the first one that ended if it was a hull,
// `body_began` if it was a body. hulld.store.pruned: batches up to this one are no longer listed.
// hulld.servers stores the last batch of each server, for a server that lost the answer to its
// COMMIT.
constexpr char kSharedTables[] = R"(
  BEGIN;
  CREATE TABLE hulld.changes (
    batch bigint,
    id text COLLATE "C",
    revision bigint NOT NULL,
    ended_at bigint NOT NULL,
    began bigint NOT NULL DEFAULT 0,
    body_began bigint NOT NULL DEFAULT 0,
    PRIMARY KEY (batch, id));
  CREATE TABLE hulld.servers (
    owner text PRIMARY KEY,
    batch bigint NOT NULL);
  ALTER TABLE hulld.store ADD COLUMN pruned bigint NOT NULL DEFAULT 0;
  COMMIT;)";

// hulld_follow requests one ID more than the limit given by its second parameter.
constexpr char kPrepareFetch[] = R"(
    PREPARE hulld_follow(bigint, bigint) AS
      SELECT s.batch, s.revision, s.epoch, s.pruned, s.owner, c.id, c.revision, c.ended_at,
        h.record, b.body, s.store_id, s.hulls, s.vertices, c.began, c.body_began, s.bodies
      FROM hulld.store s
      LEFT JOIN (
        SELECT id, max(revision) AS revision, max(ended_at) AS ended_at,
          min(nullif(began, 0)) AS began, min(nullif(body_began, 0)) AS body_began
        FROM hulld.changes WHERE batch > $1 GROUP BY id LIMIT $2) c ON true
      LEFT JOIN hulld.hulls h ON h.hull_id = c.id
      LEFT JOIN hulld.bodies b ON b.body_id = c.id;
    PREPARE hulld_record(text) AS SELECT record FROM hulld.hulls WHERE hull_id = $1;)";

constexpr char kPrepareShared[] = R"(
    PREPARE hulld_join(text) AS
      WITH joined AS (
        UPDATE hulld.store SET owner = $1, epoch = epoch + (owner <> $1)::integer,
          written_in = epoch + (owner <> $1)::integer
        RETURNING epoch, batch, revision, store_id, hulls, vertices, bodies, relaxed),
      noted AS (
        INSERT INTO hulld.epochs (epoch, owner, batch, revision)
        SELECT epoch, $1, batch, revision FROM joined ON CONFLICT (epoch) DO NOTHING)
      SELECT epoch, batch, revision, store_id, hulls, vertices, bodies, relaxed FROM joined;
    PREPARE hulld_lock AS SELECT batch FROM hulld.store FOR UPDATE;
    PREPARE hulld_put_changes(bigint[], text[], bigint[], bigint[], bigint[], bigint[]) AS
      INSERT INTO hulld.changes (batch, id, revision, ended_at, began, body_began)
      SELECT * FROM unnest($1, $2, $3, $4, $5, $6);
    PREPARE hulld_put_server(text, bigint) AS
      INSERT INTO hulld.servers (owner, batch) VALUES ($1, $2)
      ON CONFLICT (owner) DO UPDATE SET batch = excluded.batch;
    PREPARE hulld_server(text) AS SELECT batch FROM hulld.servers WHERE owner = $1;
    PREPARE hulld_drop_server(text) AS DELETE FROM hulld.servers WHERE owner = $1;
    PREPARE hulld_drop_old_servers(bigint) AS
      DELETE FROM hulld.servers WHERE batch < $1;
    PREPARE hulld_touch(bigint) AS UPDATE hulld.store SET written_in = $1;
    PREPARE hulld_prune(bigint) AS
      WITH pruned AS (UPDATE hulld.store SET pruned = $1)
      DELETE FROM hulld.changes WHERE batch <= $1;)";

// Selects the changes of peer servers after this batch.
Statement FetchStatement(uint64_t batch) {
  return {.name = "hulld_follow",
          .parameters = {EncodeBigint(batch), EncodeBigint(kMaxFollowed + 1)}};
}

// Returns the first incarnation that ended, if any. rows: the result of hulld_follow.
std::optional<Incarnation> ParseEnded(const Rows& rows, int row) {
  const auto began = [&](int column) {
    return rows.at(row, column).empty() ? UINT64_MAX : rows.bigint(row, column);
  };
  const uint64_t first = std::min(began(13), began(14));
  if (first == UINT64_MAX) return std::nullopt;
  return Incarnation{first, first == began(14)};
}

absl::Status Moved() { return absl::AbortedError("a peer server changed the hull"); }

absl::Status MakeSharedTables(Session& session) {
  const absl::StatusOr<bool> exist = HasTable(session, "hulld.changes");
  if (!exist.ok() || *exist) return exist.status();
  const absl::Status made = session.Run(kSharedTables).status();
  if (!made.ok()) session.Run("ROLLBACK").status().IgnoreError();
  return made;
}

}  // namespace

std::string PostgresStore::PrepareFetch() { return kPrepareFetch; }
std::string PostgresStore::PrepareShared() { return absl::StrCat(kPrepareFetch, kPrepareShared); }

// Serializes the creation of tables by servers that start together.
absl::Status PostgresStore::MakeSharedSchema(Session& session) {
  HULLD_RETURN_IF_ERROR(
      session.Run(absl::StrCat("SELECT pg_advisory_lock(", kSchemaLock, ")")).status());
  absl::Status made = MakeSchema(session);
  if (made.ok()) made = MakeSharedTables(session);
  session.Run(absl::StrCat("SELECT pg_advisory_unlock(", kSchemaLock, ")")).status().IgnoreError();
  return made;
}

// Makes this server one of the store's owners, and fences off a server that was previously the only
// active one.
absl::Status PostgresStore::Join() {
  HULLD_RETURN_IF_ERROR(RenewWriter());
  HULLD_ASSIGN_OR_RETURN(const Rows joined,
                         Claim({.name = "hulld_join", .parameters = {kSeveralServers}}));
  if (joined.at(0, 7) != std::string(1, '\0')) {
    return absl::FailedPreconditionError(
        "the store was open with synchronous_commit = off and not shut down cleanly; start and "
        "stop one hulld with --postgres-servers one first, which gives the store a new ID");
  }
  // Drops killed servers. A server that may still query its last batch committed it recently, by
  // the number of later batches, because the database's clock may jump.
  const uint64_t batch = batch_;
  const uint64_t oldest = batch - std::min(batch, kKeptBatches);
  return writer_->Execute({.name = "hulld_drop_old_servers", .parameters = {EncodeBigint(oldest)}})
      .status();
}

// Removes this server's last batch, which is not needed after an orderly end.
void PostgresStore::Leave() {
  if (writer_ == nullptr) return;
  writer_->Execute({.name = "hulld_drop_server", .parameters = {owner_}}).status().IgnoreError();
}

// Ends this server if changes that it needs were pruned, the store has another owner, or the store
// went back to an earlier state.
absl::Status PostgresStore::CheckStore(const Rows& rows) {
  if (rows.count() == 0) return absl::DataLossError("the row of hulld.store is missing");
  if (rows.bigint(0, 2) != epoch()) {
    End(Superseded(rows.at(0, 4)));
  } else if (rows.at(0, 10) != id_) {
    End(
        Unavailable("the store was restored to an earlier state and has a new ID; this "
                    "server exits; restart it to serve the restored store"));
  } else if (rows.bigint(0, 0) < batch_) {
    has_lost_batches_ = true;
    End(Unavailable("the database has lost ", batch_ - rows.bigint(0, 0),
                    " committed batches (failover to a lagging standby, or a restored backup); "
                    "the store gets a new ID; this server and its peers exit; restart them"));
  } else if (rows.bigint(0, 3) > batch_) {
    End(Unavailable("this server is more than ", kKeptBatches,
                    " batches behind its peers and exits; restart it to catch up"));
  } else if (rows.count() > kMaxFollowed) {
    End(Unavailable(
        "peer servers changed more than ", kMaxFollowed,
        " hulls and bodies since this server's last sync; it exits; restart it to catch up"));
  }
  return ended();
}

// rows: of hulld_follow.
absl::Status PostgresStore::NotePeerChanges(const Rows& rows) {
  HULLD_RETURN_IF_ERROR(CheckStore(rows));
  for (int i = 0; i < rows.count(); ++i) {
    const std::string id(rows.at(i, 5));
    if (id.empty()) continue;
    PeerChange& change = peer_changes_.by_id[id];
    change.revision = rows.bigint(i, 6);
    change.ended_at = std::max(change.ended_at, rows.bigint(i, 7));
    if (!change.previous.has_value()) change.previous = ParseEnded(rows, i);
    change.hull.reset();
    change.body.reset();
    if (!rows.at(i, 8).empty()) {
      change.hull = UnsealStoredHull(id, rows.at(i, 8));
      if (change.hull->ok()) change.revision = (*change.hull)->record.revision;
    } else if (!rows.at(i, 9).empty()) {
      change.body = UnsealStoredBody(id, rows.at(i, 9));
      if (change.body->ok()) change.revision = (*change.body)->record.revision;
    }
  }
  batch_ = rows.bigint(0, 0);
  revision_ = rows.bigint(0, 1);
  totals_ = {rows.bigint(0, 11), rows.bigint(0, 12), rows.bigint(0, 15)};
  if (peer_changes_.by_id.empty()) return absl::OkStatus();
  peer_changes_.revision = revision_;
  peer_changes_.totals = totals_;
  return absl::OkStatus();
}

void PostgresStore::StartFetch() {
  if (!ended().ok()) return;
  const Statement fetch = FetchStatement(batch_);
  fetching_ = follower_.TryStart(std::span(&fetch, 1));
}

absl::Status PostgresStore::Fetch() {
  std::unique_ptr<Session> started = std::exchange(fetching_, nullptr);
  if (absl::Status s = ended(); !s.ok()) {
    follower_.Drop(std::move(started));
    return s;
  }
  const Statement fetch = FetchStatement(batch_);
  const absl::StatusOr<std::vector<Rows>> rows =
      started != nullptr ? follower_.Finish(std::move(started), std::span(&fetch, 1))
                         : follower_.Execute(std::span(&fetch, 1));
  if (rows.ok()) {
    const absl::Status noted = NotePeerChanges(rows->front());
    if (has_lost_batches_) AssignNewId();
    return noted;
  }
  ++read_failures_;
  return Unavailable("cannot read changes of peer servers from the database: ",
                     rows.status().message());
}

// Runs one transaction in two round trips. The first takes the commit lock until the end of the
// transaction: batches are serialized, and all earlier commits of peer servers are known. So
// the new revisions are the next ones, and no server reads a batch before its predecessor. batch:
// the batch that may have been committed if the session is lost.
absl::Status PostgresStore::AttemptShared(std::span<Change* const> changes, Batch* batch) {
  const Statement locking[] = {{.text = "BEGIN"}, {.name = "hulld_lock"}, FetchStatement(batch_)};
  const absl::StatusOr<std::vector<Rows>> before = writer_->Execute(locking);
  const absl::Status status = before.ok() ? NotePeerChanges(before->back()) : before.status();
  std::vector<Change*> kept;
  for (Change* change : changes) {
    if (!peer_changes_.by_id.contains(change->id())) kept.push_back(change);
  }
  if (status.ok() && !kept.empty()) {
    const Batch next = {batch_ + 1, NumberChanges(kept, revision_), AddedBy(kept)};
    std::vector<Statement> statements = StatementsOf(kept);
    std::ranges::move(ListChanges(kept, next.number), std::back_inserter(statements));
    statements.push_back(
        {.name = "hulld_put_server", .parameters = {owner_, EncodeBigint(next.number)}});
    if (next.number % kBatchesPerPruning == 0 && next.number > kKeptBatches) {
      statements.push_back(
          {.name = "hulld_prune", .parameters = {EncodeBigint(next.number - kKeptBatches)}});
    }
    statements.push_back(Fence(next));
    *batch = next;
    return SendBatch(std::move(statements), next);
  }
  // Releases the commit lock without a write.
  EndTransaction(status);
  return status;
}

// Revisions already seen by clients will be assigned to other changes, so this is now a different
// store.
void PostgresStore::AssignNewId() {
  has_lost_batches_ = false;
  const absl::StatusOr<std::unique_ptr<Session>> session = OpenWriter();
  const absl::Status status =
      session.ok()
          ? (*session)->Execute({.name = "hulld_rename", .parameters = {RandomId()}}).status()
          : session.status();
  if (!status.ok())
    spdlog::error("cannot assign a new ID to the store: {}", std::string(status.message()));
}

// Returns true if this server's batch was committed. Takes the commit lock first: by then the
// transaction that held it has ended, and nothing of it can arrive later because its COMMIT was
// sent before. The sync of this transaction covers earlier commits.
absl::StatusOr<bool> PostgresStore::SharedOutcome(uint64_t batch) {
  HULLD_RETURN_IF_ERROR(RenewWriter());
  const Statement statements[] = {{.text = "BEGIN"},
                                  {.name = "hulld_touch", .parameters = {EncodeBigint(epoch())}},
                                  {.name = "hulld_server", .parameters = {owner_}},
                                  {.text = "COMMIT"}};
  HULLD_ASSIGN_OR_RETURN(const std::vector<Rows> rows, writer_->ExecuteCommit(statements));
  const Rows& last = rows[2];
  return last.count() == 1 && last.bigint(0, 0) == batch;
}

// Ends sessions that hold the commit lock without sending anything, such as the session of a server
// that stalls while sending a batch: PostgreSQL has timeouts between transactions and between
// batches of statements, but not within a batch. The database's clock may jump, so its times only
// identify the state of a session; this server measures how long that state lasts.
absl::Status PostgresStore::EndStuckTransactions() {
  constexpr char kHolders[] =
      "FROM pg_locks l JOIN pg_stat_activity a USING (pid) "
      "WHERE l.relation = 'hulld.store'::regclass AND l.mode = 'RowShareLock' AND l.granted "
      "AND a.datname = current_database() AND a.usename = current_user "
      "AND a.wait_event = 'ClientRead'";
  HULLD_ASSIGN_OR_RETURN(const Rows rows,
                         keeper_session_->Run(absl::StrCat(
                             "SELECT concat_ws(' ', a.pid, a.state_change) ", kHolders)));
  const std::map<std::string, std::chrono::steady_clock::time_point> known =
      std::exchange(stalled_since_, {});
  const auto now = std::chrono::steady_clock::now();
  for (int i = 0; i < rows.count(); ++i) {
    const std::string state(rows.at(i, 0));
    const auto found = known.find(state);
    const auto since = found != known.end() ? found->second : now;
    stalled_since_[state] = since;
    if (now - since < options_.send_timeout) continue;
    HULLD_RETURN_IF_ERROR(
        keeper_session_
            ->Run(absl::StrCat("SELECT pg_terminate_backend(a.pid) ", kHolders,
                               " AND concat_ws(' ', a.pid, a.state_change) = '", state, "'"))
            .status());
  }
  return absl::OkStatus();
}

void PostgresStore::StartNotices() {
  const auto on_batch = [this](uint64_t batch) {
    if (batch > batch_) NotifyPeerCommit();
  };
  notices_ = std::make_unique<BatchNotices>(
      [this] { return OpenListener(); }, options_.heartbeat, on_batch,
      absl::StrCat("the server polls it every ", options_.poll_interval.count(), " ms"));
}

// True if notices arrive. The keeper still polls the store with each heartbeat. A batch found by
// polling but not announced by then means that a notice was lost; the keeper then polls more often
// until a notice arrives.
bool PostgresStore::ReceivesNotices() const {
  return notices_ != nullptr && notices_->is_listening() &&
         notices_->last_received() >= polled_batch_;
}

// Polls for new commits of peer servers, and reports them.
absl::Status PostgresStore::PollPeers() {
  HULLD_ASSIGN_OR_RETURN(const uint64_t batch, LastBatch(*keeper_session_));
  polled_batch_ = batch;
  if (batch != batch_) NotifyPeerCommit();
  return absl::OkStatus();
}

// Called with the mutex held, so that OnPeerCommit blocks while the previous callback is running.
void PostgresStore::NotifyPeerCommit() {
  const std::lock_guard lock(mutex_);
  if (on_peer_commit_) on_peer_commit_();
}

void PostgresStore::OnPeerCommit(std::function<void()> committed) {
  const std::lock_guard lock(mutex_);
  on_peer_commit_ = std::move(committed);
}

// Compares the hull's record with `hull`, as of a sequence. rows: of hulld_sequence.
absl::Status PostgresStore::CheckRecord(const HullRecord& hull, const Rows& rows) {
  if (rows.count() == 0) return Moved();
  HULLD_ASSIGN_OR_RETURN(const StoredHull now, UnsealStoredHull(hull.hull_id, rows.at(0, 1)));
  return now.record == hull ? absl::OkStatus() : Moved();
}

// Explains vertices that contradict the record. ABORTED: a peer server changed the hull since.
absl::Status PostgresStore::ExplainDamage(const StoredHull& hull, const absl::Status& damage) {
  HULLD_ASSIGN_OR_RETURN(const Rows rows,
                         ReadOne({.name = "hulld_record", .parameters = {hull.record.hull_id}}));
  if (rows.count() == 0) return Moved();
  HULLD_ASSIGN_OR_RETURN(const StoredHull now,
                         UnsealStoredHull(hull.record.hull_id, rows.at(0, 0)));
  return now.record.revision == hull.record.revision ? damage : Moved();
}

}  // namespace hulld::server
