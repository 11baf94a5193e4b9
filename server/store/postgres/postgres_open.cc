// Opening the store: sessions, tables, and waiting to become active.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/contract/stopped_call.h"
#include "server/process/random_id.h"
#include "server/store/postgres/batch_statements.h"
#include "server/store/postgres/postgres_store.h"

namespace hulld::server {
namespace {

constexpr int kMaxReaders = 8;
constexpr int kMinServerVersion = 140'000;
// Pauses between attempts to become the active server.
constexpr std::chrono::milliseconds kMinLockPause{10};
constexpr std::chrono::milliseconds kMaxLockPause{250};

// hulld.store has one row. `revision` and `batch`, the number of batches, belong to the last
// committed batch. `epoch` and `owner` belong to the active server; a batch writes its own epoch
// as `written_in`, and store_fence refuses it if the two differ. `relaxed`: true with
// synchronous_commit = off, from the start of a server until its orderly end.
//
// `hulls`, `vertices` and `bodies` are the totals of the store.
//
// hulld.migration exists while a migration fills the store, and names its source.
//
// hulld.epochs contains the state at the start of each epoch. The other tables contain the values
// of store_keys.h, keyed first by the ID of the hull or body; an incarnation is a create_revision.
// record, body, sequence and vertices are sealed values. Coordinates do not compress, hence
// EXTERNAL.
//
// Plain tables and statements only, for databases that speak PostgreSQL's protocol and shard rows
// by key.
constexpr char kTables[] = R"(
  CREATE TABLE hulld.store (
    one boolean PRIMARY KEY DEFAULT true CHECK (one),
    format bigint NOT NULL,
    store_id text NOT NULL,
    revision bigint NOT NULL,
    batch bigint NOT NULL,
    epoch bigint NOT NULL,
    owner text NOT NULL,
    written_in bigint NOT NULL,
    relaxed boolean NOT NULL,
    hulls bigint NOT NULL DEFAULT 0,
    vertices bigint NOT NULL DEFAULT 0,
    bodies bigint NOT NULL DEFAULT 0,
    CONSTRAINT store_fence CHECK (written_in = epoch));
  CREATE TABLE hulld.epochs (
    epoch bigint PRIMARY KEY,
    owner text NOT NULL,
    began timestamptz NOT NULL DEFAULT now(),
    batch bigint NOT NULL,
    revision bigint NOT NULL);
  CREATE TABLE hulld.hulls (
    hull_id text COLLATE "C" PRIMARY KEY,
    record bytea NOT NULL);
  CREATE TABLE hulld.bodies (
    body_id text COLLATE "C" PRIMARY KEY,
    body bytea NOT NULL);
  CREATE TABLE hulld.writers (
    hull_id text COLLATE "C",
    incarnation bigint,
    writer_id text COLLATE "C",
    sequence bytea NOT NULL,
    PRIMARY KEY (hull_id, incarnation, writer_id));
  CREATE TABLE hulld.bases (
    hull_id text COLLATE "C",
    incarnation bigint,
    revision bigint,
    part integer,
    vertices bytea NOT NULL,
    PRIMARY KEY (hull_id, incarnation, revision, part));
  CREATE TABLE hulld.deltas (
    hull_id text COLLATE "C",
    incarnation bigint,
    revision bigint,
    vertices bytea NOT NULL,
    PRIMARY KEY (hull_id, incarnation, revision));
  ALTER TABLE hulld.bases ALTER COLUMN vertices SET STORAGE EXTERNAL;
  ALTER TABLE hulld.deltas ALTER COLUMN vertices SET STORAGE EXTERNAL;)";

// Settings of every session. The database aborts statements of a server that has disconnected, or
// that stalls while it holds locks. The timeouts are not tuned, like those in session.cc, and are
// shorter than PostgresOptions::answer_timeout. Every statement uses an index, even if its plan was
// made when the table was small.
constexpr char kSettings[] = R"(
  SET search_path = '';
  SET default_transaction_isolation = 'read committed';
  SET enable_seqscan = off;
  SET jit = off;
  SET idle_in_transaction_session_timeout = '10s';
  SET client_connection_check_interval = '2s';
  SET tcp_keepalives_idle = 5;
  SET tcp_keepalives_interval = 2;
  SET tcp_keepalives_count = 3;)";

constexpr char kPrepareClaims[] = R"(
    PREPARE hulld_fence(bigint, bigint, bigint, bigint, bigint, bigint) AS
      UPDATE hulld.store SET revision = $1, batch = $2, written_in = $3, hulls = hulls + $4,
        vertices = vertices + $5, bodies = bodies + $6;
    PREPARE hulld_claim(text, text, boolean) AS
      WITH claimed AS (
        UPDATE hulld.store SET epoch = epoch + 1, written_in = epoch + 1, owner = $1,
          store_id = CASE WHEN relaxed THEN $2 ELSE store_id END, relaxed = $3
        RETURNING epoch, batch, revision, store_id, hulls, vertices, bodies),
      noted AS (
        INSERT INTO hulld.epochs (epoch, owner, batch, revision)
        SELECT epoch, $1, batch, revision FROM claimed)
      SELECT epoch, batch, revision, store_id, hulls, vertices, bodies FROM claimed;
    PREPARE hulld_reclaim(text) AS
      WITH claimed AS (
        UPDATE hulld.store SET epoch = epoch + 1, written_in = epoch + 1 WHERE owner = $1
        RETURNING epoch, batch, revision),
      noted AS (
        INSERT INTO hulld.epochs (epoch, owner, batch, revision)
        SELECT epoch, $1, batch, revision FROM claimed)
      SELECT epoch, batch FROM claimed;
    PREPARE hulld_next_epoch(bigint) AS
      SELECT batch FROM hulld.epochs WHERE epoch > $1 ORDER BY epoch LIMIT 1;
    PREPARE hulld_rename(text) AS
      UPDATE hulld.store SET store_id = $1, written_in = epoch;
    PREPARE hulld_close(bigint) AS
      UPDATE hulld.store SET relaxed = false, written_in = $1;)";

constexpr char kPrepareReads[] = R"(
    PREPARE hulld_owner AS SELECT owner FROM hulld.store;
    PREPARE hulld_find(text[]) AS
      SELECT s.revision, r.id, r.is_body, false, r.value
      FROM hulld.store s LEFT JOIN (
        SELECT hull_id AS id, false AS is_body, record AS value
        FROM hulld.hulls WHERE hull_id = ANY ($1)
        UNION ALL
        SELECT body_id, true, body FROM hulld.bodies WHERE body_id = ANY ($1)) r ON true;
    PREPARE hulld_list(text, text, bigint, boolean, boolean, bigint) AS
      SELECT s.revision, r.id, r.is_body, r.before > $6,
        CASE WHEN r.before <= $6 THEN r.value END
      FROM hulld.store s LEFT JOIN (
        SELECT id, is_body, value,
          sum(length(value)) OVER (ORDER BY id) - length(value) AS before
        FROM (
          (SELECT hull_id AS id, false AS is_body, record AS value FROM hulld.hulls
           WHERE $4 AND hull_id >= $1 AND hull_id > $2 ORDER BY hull_id LIMIT $3)
          UNION ALL
          (SELECT body_id, true, body FROM hulld.bodies
           WHERE $5 AND body_id >= $1 AND body_id > $2 ORDER BY body_id LIMIT $3)
          ORDER BY id LIMIT $3) listed) r ON true
      ORDER BY r.id;
    PREPARE hulld_base(text, bigint, bigint) AS
      SELECT part, vertices FROM hulld.bases
      WHERE hull_id = $1 AND incarnation = $2 AND revision = $3 ORDER BY part;
    PREPARE hulld_deltas(text, bigint, bigint, bigint) AS
      SELECT revision, vertices FROM hulld.deltas
      WHERE hull_id = $1 AND incarnation = $2 AND revision > $3 AND revision <= $4
      ORDER BY revision;
    PREPARE hulld_sequence(text, bigint, text) AS
      SELECT w.sequence, h.record FROM hulld.hulls h
      LEFT JOIN hulld.writers w
        ON w.hull_id = h.hull_id AND w.incarnation = $2 AND w.writer_id = $3
      WHERE h.hull_id = $1;
    PREPARE hulld_writers(text, bigint) AS
      SELECT writer_id, sequence FROM hulld.writers
      WHERE hull_id = $1 AND incarnation = $2 ORDER BY writer_id;)";

// Host and process identify the server to the operator; the random suffix makes the name unique.
std::string OwnerName() {
  char host[256] = "";
  gethostname(host, sizeof host - 1);
  return absl::StrCat(host, " process ", getpid(), " ", RandomId());
}

// Returns the error shown at startup: the failure and, if known, the remedy.
absl::Status OpenFailed(const absl::Status& status) {
  std::string advice;
  if (SqlState(status) == "42501") {
    advice =
        "; the schema \"hulld\" and its tables must belong to the role of hulld, or the role must "
        "be allowed to create them: CREATE SCHEMA hulld AUTHORIZATION the_role";
  }
  return absl::Status(status.code(),
                      absl::StrCat("the store in PostgreSQL (", PostgresOptions::kSetting,
                                   "): ", status.message(), advice));
}

}  // namespace

PostgresStore::PostgresStore(PostgresOptions options, Conninfo conninfo)
    : options_(std::move(options)),
      conninfo_(std::move(conninfo)),
      owner_(OwnerName()),
      readers_([this] { return OpenReader(); }, kMaxReaders),
      follower_([this] { return OpenReader(); }, 1) {}

absl::StatusOr<std::unique_ptr<PostgresStore>> PostgresStore::Open(PostgresOptions options) {
  absl::StatusOr<Conninfo> conninfo = ParseConninfo(options.conninfo);
  if (!conninfo.ok()) {
    return Prefixed(absl::StrCat(PostgresOptions::kSetting, ": "), conninfo.status());
  }
  std::unique_ptr<PostgresStore> store(new PostgresStore(std::move(options), *std::move(conninfo)));
  if (absl::Status s = store->BecomeActive(); !s.ok()) return OpenFailed(s);
  const Session& keeper = *store->keeper_session_;
  const bool shared = store->options_.shared;
  spdlog::info(
      "store: {}, PostgreSQL {}; acknowledged changes are committed there{} (synchronous_commit = "
      "{}); {}epoch {}",
      keeper.Describe(), keeper.server_version() / 10'000,
      store->durability_ == Durability::kRelaxed ? ", but an outage may lose them" : "",
      store->synchronous_commit_, shared ? "peer servers may be active; " : "", store->epoch());
  store->MeasureDisk().IgnoreError();
  if (shared && store->options_.notices) store->StartNotices();
  store->keeper_ = std::thread([raw = store.get()] { raw->RunKeeper(); });
  return store;
}

absl::Status PostgresStore::BecomeActive() {
  HULLD_ASSIGN_OR_RETURN(keeper_session_, OpenKeeper());
  HULLD_RETURN_IF_ERROR(CheckServer(*keeper_session_));
  HULLD_RETURN_IF_ERROR(WaitForTurn());
  HULLD_RETURN_IF_ERROR(options_.shared ? MakeSharedSchema(*keeper_session_)
                                        : MakeSchema(*keeper_session_));
  return BeginWithRetries();
}

// The connection has worked before, so a failure is treated as temporary: for example, the database
// may refuse more sessions while those of killed servers still exist.
absl::Status PostgresStore::BeginWithRetries() {
  const auto deadline = std::chrono::steady_clock::now() + options_.retry_timeout;
  // Begin must not run twice: the store would appear not to have been closed.
  bool has_begun = false;
  for (auto pause = kMinLockPause;; pause = std::min(2 * pause, kMaxLockPause)) {
    absl::Status status;
    if (!has_begun) status = options_.shared ? Join() : Begin();
    has_begun = status.ok() || has_begun;
    if (status.ok()) status = OpenFirstReaders();
    if (!IsLost(status) || std::chrono::steady_clock::now() + pause >= deadline) return status;
    if (Stopped(options_.should_stop)) {
      return absl::CancelledError("shutdown requested before the database accepted the session");
    }
    std::this_thread::sleep_for(pause);
  }
}

// Opens the sessions needed for loading.
absl::Status PostgresStore::OpenFirstReaders() {
  const Statement owner = {.name = "hulld_owner"};
  const absl::Status status = readers_.Execute(std::span(&owner, 1)).status();
  if (!status.ok() || !options_.shared) return status;
  return follower_.Execute(std::span(&owner, 1)).status();
}

absl::StatusOr<std::unique_ptr<Session>> PostgresStore::OpenSession(
    const std::string& settings) const {
  absl::StatusOr<std::unique_ptr<Session>> session =
      Session::Open(conninfo_, options_.answer_timeout);
  if (!session.ok()) return session;
  const absl::Status set =
      (*session)
          ->Run(absl::StrCat(kSettings, "SET lock_timeout = ", options_.lock_timeout.count(), ";",
                             settings))
          .status();
  if (!set.ok()) return set;
  return session;
}

absl::StatusOr<std::unique_ptr<Session>> PostgresStore::OpenWriter() const {
  return OpenSession(absl::StrCat("SET synchronous_commit = ", synchronous_commit_, ";",
                                  kPrepareClaims, PrepareBatchStatements(),
                                  options_.shared ? PrepareShared() : ""));
}

absl::StatusOr<std::unique_ptr<Session>> PostgresStore::OpenReader() const {
  return OpenSession(absl::StrCat("SET statement_timeout = ", options_.answer_timeout.count(), ";",
                                  kPrepareReads, options_.shared ? PrepareFetch() : ""));
}

// The database ends this session, and with it this server's claim, after several missed heartbeats.
absl::StatusOr<std::unique_ptr<Session>> PostgresStore::OpenKeeper() const {
  const auto idle_timeout = 10 * options_.heartbeat;
  return OpenSession(absl::StrCat("SET statement_timeout = ", options_.answer_timeout.count(),
                                  "; SET idle_session_timeout = ", idle_timeout.count()));
}

// Its transactions do not wait for the disk because notices need not be durable.
absl::StatusOr<std::unique_ptr<Session>> PostgresStore::OpenListener() const {
  return OpenSession(absl::StrCat("SET statement_timeout = ", options_.answer_timeout.count(),
                                  "; SET synchronous_commit = off"));
}

// Checks the server's version and determines its durability.
absl::Status PostgresStore::CheckServer(Session& session) {
  if (session.server_version() < kMinServerVersion) {
    return absl::FailedPreconditionError(absl::StrCat("the database is PostgreSQL ",
                                                      session.server_version() / 10'000,
                                                      "; hulld requires 14 or later"));
  }
  HULLD_ASSIGN_OR_RETURN(
      const Rows settings,
      session.Run("SELECT current_setting('synchronous_commit'), current_setting('fsync')"));
  // A source of a migration stays the same store if the migration is killed.
  const bool migrates = options_.migrating || options_.must_exist;
  synchronous_commit_ = migrates ? "on" : std::string(settings.at(0, 0));
  const bool is_sync = synchronous_commit_ != "off" && settings.at(0, 1) == "on";
  durability_ = is_sync ? Durability::kSync : Durability::kRelaxed;
  if (options_.shared && !is_sync) {
    return absl::FailedPreconditionError(
        "--postgres-servers many requires synchronous_commit = on and fsync = on; without them an "
        "outage could revert changes that peer servers have already applied");
  }
  HULLD_ASSIGN_OR_RETURN(const bool exists, CheckFormat(session));
  if (exists || !options_.must_exist) return absl::OkStatus();
  return absl::NotFoundError("the database contains no hulld store");
}

// Atomic: a server killed in the middle leaves either all of the tables or none.
absl::Status PostgresStore::MakeSchema(Session& session) {
  HULLD_ASSIGN_OR_RETURN(const bool exists, CheckFormat(session));
  if (exists) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(const Rows schema,
                         session.Run("SELECT 1 FROM pg_namespace WHERE nspname = 'hulld'"));
  const absl::Status made =
      session
          .Run(absl::StrCat("BEGIN;", schema.count() == 0 ? "CREATE SCHEMA hulld;" : "", kTables,
                            "INSERT INTO hulld.store (format, store_id, revision, batch, epoch, "
                            "owner, written_in, relaxed) VALUES (",
                            kFormat, ", '", RandomId(), "', 0, 0, 0, '', 0, false); COMMIT;"))
          .status();
  if (!made.ok()) session.Run("ROLLBACK").status().IgnoreError();
  return made;
}

// Makes this server the owner of the store.
absl::Status PostgresStore::Begin() {
  HULLD_RETURN_IF_ERROR(RenewWriter());
  HULLD_ASSIGN_OR_RETURN(const Rows previous, writer_->Run("SELECT store_id FROM hulld.store"));
  const std::string is_relaxed(1, durability_ == Durability::kRelaxed);
  const absl::Status claimed =
      Claim({.name = "hulld_claim", .parameters = {owner_, RandomId(), is_relaxed}}).status();
  if (claimed.ok() && id_ != previous.at(0, 0)) {
    spdlog::warn(
        "store {} was open with synchronous_commit = off and not shut down cleanly; its last "
        "acknowledged changes may be lost; continuing at revision {} as store {}",
        std::string(previous.at(0, 0)), revision_, id_);
  }
  return claimed;
}

absl::Status PostgresStore::RenewWriter() {
  HULLD_ASSIGN_OR_RETURN(writer_, OpenWriter());
  return absl::OkStatus();
}

// Runs a claim and reads the state of the store from the first columns of the returned row.
absl::StatusOr<Rows> PostgresStore::Claim(Statement claim) {
  absl::StatusOr<Rows> rows = writer_->Execute(std::move(claim));
  if (!rows.ok()) return rows;
  if (rows->count() != 1) return absl::DataLossError("the row of hulld.store is missing");
  epoch_ = rows->bigint(0, 0);
  batch_ = rows->bigint(0, 1);
  revision_ = rows->bigint(0, 2);
  id_ = std::string(rows->at(0, 3));
  totals_ = {rows->bigint(0, 4), rows->bigint(0, 5), rows->bigint(0, 6)};
  return rows;
}

absl::Status PostgresStore::WaitForTurn() {
  if (options_.take_over) return absl::OkStatus();
  // Retries quickly at first: a server that was just killed may still hold the lock.
  for (auto pause = kMinLockPause;; pause = std::min(2 * pause, kMaxLockPause)) {
    absl::StatusOr<bool> locked = Unavailable("");
    if (keeper_session_ != nullptr) locked = TryLock(*keeper_session_);
    has_lock_ = locked.ok() && *locked;
    if (has_lock_) return absl::OkStatus();
    if (!locked.ok()) {
      // Also waits while a database restarts or fails over.
      absl::StatusOr<std::unique_ptr<Session>> session = OpenKeeper();
      keeper_session_ = session.ok() ? *std::move(session) : nullptr;
    } else if (pause < kMaxLockPause && 2 * pause >= kMaxLockPause) {
      const absl::StatusOr<std::string> owner = Owner(*keeper_session_);
      spdlog::info("another hulld is active on this database ({}); waiting until it exits{}",
                   owner.ok() && !owner->empty() ? *owner : "starting",
                   options_.shared ? "" : "; pass --take-over to replace it");
    }
    if (Stopped(options_.should_stop)) {
      return absl::CancelledError("shutdown requested while waiting for the active server");
    }
    std::this_thread::sleep_for(pause);
  }
}

}  // namespace hulld::server
