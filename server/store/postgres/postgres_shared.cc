// Several active servers over one store: how they commit, and follow each other.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <utility>

#include "server/process/random_id.h"
#include "server/store/change_revisions.h"
#include "server/store/postgres/batch_statements.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/sealed_hull.h"

namespace hulld::server {
namespace {

using Clock = std::chrono::steady_clock;

// Names the advisory lock under which the tables are made.
constexpr uint64_t kSchemaLock = 0x68756c6c65;
// Batches whose changes are kept for servers that did not read them yet, and after how many batches
// older ones are dropped.
constexpr uint64_t kKeptBatches = 1 << 16;
constexpr uint64_t kBatchesPerPruning = 1 << 10;
// IDs that a server takes note of at a time, at most. That many took 0.2 s under the registry's
// mutex (observed, with hulls that had come and gone, at load 6); they are one moment for readers,
// so that they cannot be taken over in parts.
constexpr int kMostFollowed = 1 << 17;
constexpr std::chrono::milliseconds kFirstPause{10};
constexpr std::chrono::milliseconds kLongestPause{500};

// hulld.changes tells which IDs each batch changed, for the other servers: `revision` is the
// store's after the last change of the ID in the batch, `ended_at` that at which an incarnation of
// it ended, or 0; `began` the create_revision of the first that did where that was a hull,
// `body_began` where it was a body. hulld.store.pruned: batches up
// to this one are not told any more. hulld.servers tells the last batch of each server, for one
// that lost the answer to its COMMIT.
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
    batch bigint NOT NULL,
    seen timestamptz NOT NULL DEFAULT now());
  ALTER TABLE hulld.store ADD COLUMN pruned bigint NOT NULL DEFAULT 0;
  COMMIT;)";

// hulld_follow asks for one ID more than is taken note of. Its second parameter is that number.
constexpr char kPrepareFollow[] = R"(
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
    PREPARE hulld_record(text) AS SELECT record FROM hulld.hulls WHERE hull_id = $1;
    PREPARE hulld_sequence_and_record(text, bigint, text) AS
      SELECT w.sequence, h.record FROM hulld.hulls h
      LEFT JOIN hulld.writers w
        ON w.hull_id = h.hull_id AND w.incarnation = $2 AND w.writer_id = $3
      WHERE h.hull_id = $1;)";

constexpr char kPrepareShared[] = R"(
    PREPARE hulld_join(text) AS
      WITH joined AS (
        UPDATE hulld.store SET owner = $1, epoch = epoch + (owner <> $1)::integer,
          written_in = epoch + (owner <> $1)::integer
        RETURNING epoch, batch, revision, store_id, relaxed, hulls, vertices, bodies),
      noted AS (
        INSERT INTO hulld.epochs (epoch, owner, batch, revision)
        SELECT epoch, $1, batch, revision FROM joined ON CONFLICT (epoch) DO NOTHING)
      SELECT epoch, batch, revision, store_id, relaxed, hulls, vertices, bodies FROM joined;
    PREPARE hulld_turn AS SELECT batch FROM hulld.store FOR UPDATE;
    PREPARE hulld_put_changes(bigint, text[], bigint[], bigint[], bigint[], bigint[]) AS
      INSERT INTO hulld.changes (batch, id, revision, ended_at, began, body_began)
      SELECT $1, * FROM unnest($2, $3, $4, $5, $6);
    PREPARE hulld_put_server(text, bigint) AS
      INSERT INTO hulld.servers (owner, batch) VALUES ($1, $2)
      ON CONFLICT (owner) DO UPDATE SET batch = excluded.batch, seen = now();
    PREPARE hulld_server(text) AS SELECT batch FROM hulld.servers WHERE owner = $1;
    PREPARE hulld_drop_server(text) AS DELETE FROM hulld.servers WHERE owner = $1;
    PREPARE hulld_drop_old_servers AS
      DELETE FROM hulld.servers WHERE seen < now() - interval '1 day';
    PREPARE hulld_touch(bigint) AS UPDATE hulld.store SET written_in = $1;
    PREPARE hulld_prune(bigint) AS
      WITH pruned AS (UPDATE hulld.store SET pruned = $1)
      DELETE FROM hulld.changes WHERE batch <= $1;)";

// What others did after this batch.
Statement AskForOthers(uint64_t batch) {
  return {.name = "hulld_follow",
          .parameters = {EncodeBigint(batch), EncodeBigint(kMostFollowed + 1)}};
}

// The create_revision of the incarnation that a change ends; 0: it ends none. Nobody knows it of a
// damaged hull; 1 says that the hull was there before, which is what others need to know.
uint64_t BeganOfEnded(const Change& change) {
  const auto known = [](uint64_t revision) { return std::max<uint64_t>(revision, 1); };
  if (change.replaced.has_value()) return known(change.replaced->record.create_revision);
  if (!change.deleted) return 0;
  return known(change.body != nullptr ? change.body->record.create_revision
                                      : change.hull.record.create_revision);
}

// What a batch tells the other servers.
Statement ChangesRow(std::span<Change* const> changes, uint64_t batch) {
  struct Row {
    uint64_t revision = 0;
    uint64_t ended_at = 0;
    uint64_t began = 0;
    bool was_body = false;
  };
  std::map<std::string, Row> rows;
  for (const Change* change : changes) {
    Row& row = rows[change->id()];
    row.revision = change->revision;
    const uint64_t began = BeganOfEnded(*change);
    if (began != 0 || change->deleted) row.ended_at = row.revision;
    if (row.began == 0) row.was_body = change->body != nullptr;
    if (row.began == 0) row.began = began;
  }
  using Element = ArrayParameter::Element;
  ArrayParameter ids(Element::kText);
  ArrayParameter revisions(Element::kBigint);
  ArrayParameter ends(Element::kBigint);
  ArrayParameter began(Element::kBigint);
  ArrayParameter bodies_began(Element::kBigint);
  for (const auto& [id, row] : rows) {
    ids.Add(id);
    revisions.Add(EncodeBigint(row.revision));
    ends.Add(EncodeBigint(row.ended_at));
    began.Add(EncodeBigint(row.was_body ? 0 : row.began));
    bodies_began.Add(EncodeBigint(row.was_body ? row.began : 0));
  }
  return {.name = "hulld_put_changes",
          .parameters = {EncodeBigint(batch), ids.Take(), revisions.Take(), ends.Take(),
                         began.Take(), bodies_began.Take()}};
}

// Which incarnation ended first. rows: those of hulld_follow.
void NoteFormer(const Rows& rows, int row, OtherChange& other) {
  const auto began = [&](int column) {
    return rows.at(row, column).empty() ? UINT64_MAX : rows.bigint(row, column);
  };
  const uint64_t first = std::min(began(13), began(14));
  if (first == UINT64_MAX) return;
  other.former_began = first;
  other.former_was_body = first == began(14);
}

absl::Status Moved() { return absl::AbortedError("another server changed the hull meanwhile"); }

absl::Status MakeSharedTables(Session& session) {
  const absl::StatusOr<Rows> exist = session.Run("SELECT to_regclass('hulld.changes') IS NOT NULL");
  if (!exist.ok()) return exist.status();
  if (exist->at(0, 0) == "t") return absl::OkStatus();
  const absl::Status made = session.Run(kSharedTables).status();
  if (!made.ok()) session.Run("ROLLBACK").status().IgnoreError();
  return made;
}

}  // namespace

std::string PostgresStore::PrepareFollow() { return kPrepareFollow; }
std::string PostgresStore::PrepareShared() { return absl::StrCat(kPrepareFollow, kPrepareShared); }

// Servers that start at the same time make the tables one after the other.
absl::Status PostgresStore::MakeSharedSchema(Session& session) {
  const absl::Status locked =
      RunPatiently(session, absl::StrCat("SELECT pg_advisory_lock(", kSchemaLock, ")")).status();
  if (!locked.ok()) return locked;
  absl::Status made = MakeSchema(session);
  if (made.ok()) made = MakeSharedTables(session);
  session.Run(absl::StrCat("SELECT pg_advisory_unlock(", kSchemaLock, ")")).status().IgnoreError();
  return made;
}

// The store is ours and that of others from here on, and not that of a server that was active alone
// before.
absl::Status PostgresStore::Join() {
  absl::StatusOr<std::unique_ptr<Session>> writer = OpenWriter();
  if (!writer.ok()) return writer.status();
  writer_ = *std::move(writer);
  const absl::StatusOr<Rows> joined =
      writer_->Ask({.name = "hulld_join", .parameters = {kSeveralServers}});
  if (!joined.ok()) return joined.status();
  if (joined->count() != 1) return absl::DataLossError("the row of hulld.store is missing");
  if (joined->at(0, 4) != std::string(1, '\0')) {
    return absl::FailedPreconditionError(
        "the store was open with synchronous_commit = off and was not closed: start and end one "
        "hulld with --postgres-servers one first, which makes it another store");
  }
  // Drops servers that were killed. One that still asks for its last batch committed it just now.
  const absl::Status dropped = writer_->Ask({.name = "hulld_drop_old_servers"}).status();
  if (!dropped.ok()) return dropped;
  epoch_ = joined->bigint(0, 0);
  batch_ = joined->bigint(0, 1);
  seen_batch_ = batch_;
  revision_ = joined->bigint(0, 2);
  id_ = std::string(joined->at(0, 3));
  totals_ = {joined->bigint(0, 5), joined->bigint(0, 6), joined->bigint(0, 7)};
  spdlog::info(
      "hulls live in {}, PostgreSQL {}; an acknowledged change is committed there "
      "(synchronous_commit = {}); other servers may be active beside this one; epoch {}",
      writer_->Describe(), writer_->server_version() / 10'000, synchronous_commit_, epoch());
  MeasureDisk().IgnoreError();
  return absl::OkStatus();
}

// Others need not remember the last batch of a server that ended in order.
void PostgresStore::Leave() {
  if (writer_ == nullptr) return;
  writer_->Ask({.name = "hulld_drop_server", .parameters = {owner_}}).status().IgnoreError();
}

// What is not told any more, is not ours any more, or went back, ends this server.
absl::Status PostgresStore::CheckStore(const Rows& rows) {
  if (rows.count() == 0) return absl::DataLossError("the row of hulld.store is missing");
  if (rows.bigint(0, 2) != epoch()) {
    End(Superseded(rows.at(0, 4)));
  } else if (rows.at(0, 10) != id_) {
    End(absl::UnavailableError(
        "the store was given a new ID, as it was put back to an earlier time: this server ends; "
        "start it again to serve what there is"));
  } else if (rows.bigint(0, 0) < batch_) {
    went_back_ = true;
    End(absl::UnavailableError(absl::StrCat(
        "the database has lost ", batch_ - rows.bigint(0, 0),
        " batches that were committed in it (a standby that was behind, or a restored backup): "
        "this server ends, and the others do once they see that the store has a new ID")));
  } else if (rows.bigint(0, 3) > batch_) {
    End(absl::UnavailableError(
        absl::StrCat("this server did not follow the others for more than ", kKeptBatches,
                     " batches: it ends; start it again to serve what there is")));
  } else if (rows.count() > kMostFollowed) {
    End(absl::UnavailableError(absl::StrCat(
        "others changed more than ", kMostFollowed,
        " hulls and bodies since this server followed them last: it ends; start it again to serve "
        "what there is")));
  }
  return ended();
}

// rows: of hulld_follow.
absl::Status PostgresStore::NoteOthers(const Rows& rows) {
  if (absl::Status s = CheckStore(rows); !s.ok()) return s;
  for (int i = 0; i < rows.count(); ++i) {
    const std::string id(rows.at(i, 5));
    if (id.empty()) continue;
    OtherChange& other = others_.by_id[id];
    other.revision = rows.bigint(i, 6);
    other.ended_at = std::max(other.ended_at, rows.bigint(i, 7));
    if (other.former_began == 0) NoteFormer(rows, i, other);
    other.hull.reset();
    other.body.reset();
    if (!rows.at(i, 8).empty()) {
      other.hull = UnsealStoredHull(id, rows.at(i, 8));
      if (other.hull->ok()) other.revision = (*other.hull)->record.revision;
    } else if (!rows.at(i, 9).empty()) {
      other.body = UnsealStoredBody(id, rows.at(i, 9));
      if (other.body->ok()) other.revision = (*other.body)->record.revision;
    }
  }
  batch_ = rows.bigint(0, 0);
  seen_batch_ = batch_;
  revision_ = rows.bigint(0, 1);
  totals_ = {rows.bigint(0, 11), rows.bigint(0, 12), rows.bigint(0, 15)};
  if (others_.by_id.empty()) return absl::OkStatus();
  others_.revision = revision_;
  others_.totals = totals_;
  return absl::OkStatus();
}

void PostgresStore::StartFollow() {
  if (!options_.shared || !ended().ok()) return;
  const Statement follow = AskForOthers(batch_);
  following_ = follower_.TryStart(std::span(&follow, 1));
}

absl::Status PostgresStore::Follow() {
  std::unique_ptr<Session> asked = std::exchange(following_, nullptr);
  if (absl::Status s = ended(); !s.ok()) {
    follower_.GiveUp(std::move(asked));
    return s;
  }
  // Nobody else commits.
  if (!options_.shared) return absl::OkStatus();
  const Statement follow = AskForOthers(batch_);
  const absl::StatusOr<std::vector<Rows>> rows =
      asked != nullptr ? follower_.Finish(std::move(asked), std::span(&follow, 1))
                       : follower_.Ask(std::span(&follow, 1));
  if (rows.ok()) {
    const absl::Status noted = NoteOthers(rows->front());
    if (went_back_) GiveNewId();
    return noted;
  }
  ++read_failures_;
  return absl::UnavailableError(absl::StrCat("cannot ask the database what other servers changed: ",
                                             rows.status().message()));
}

// What a batch does before it is written: it takes the turn, and learns what others did before.
absl::Status PostgresStore::TakeTurn() {
  std::vector<Statement> turn;
  turn.push_back({.text = "BEGIN"});
  turn.push_back({.name = "hulld_turn"});
  turn.push_back(AskForOthers(batch_));
  const absl::StatusOr<std::vector<Rows>> rows = writer_->Ask(turn);
  return rows.ok() ? NoteOthers(rows->back()) : rows.status();
}

// Nothing was written. status: how it ended.
void PostgresStore::GiveTurnBack(const absl::Status& status) {
  if (IsLost(status) || !writer_->Run("ROLLBACK").ok()) writer_ = nullptr;
  if (went_back_) GiveNewId();
}

// The turn of a batch that is not written.
absl::Status PostgresStore::HoldOthers() {
  if (!options_.shared) return absl::OkStatus();
  if (absl::Status s = ended(); !s.ok()) return s;
  absl::Status status;
  if (writer_ == nullptr) {
    absl::StatusOr<std::unique_ptr<Session>> session = OpenWriter();
    status = session.status();
    if (session.ok()) writer_ = *std::move(session);
  }
  if (status.ok()) {
    status = TakeTurn();
    if (status.ok()) return status;
    GiveTurnBack(status);
  }
  return absl::UnavailableError(
      absl::StrCat("cannot hold the database's turn: ", status.message()));
}

// The database may have ended the session, and the turn with it. What it answers is of the session
// that took it.
bool PostgresStore::ReleaseOthers() {
  if (!options_.shared) return true;
  if (writer_ != nullptr) GiveTurnBack(absl::OkStatus());
  return writer_ != nullptr;
}

// One transaction, in two round trips. The first takes the turn, which lasts until the end of the
// transaction: batches come one after the other, and what others committed before is known. So the
// revisions that are given then are the next, and nobody reads a batch before one that goes before
// it. batch: what may have been committed if the session is lost.
absl::Status PostgresStore::AttemptShared(std::span<Change* const> changes, SharedBatch* batch) {
  absl::Status status = TakeTurn();
  std::vector<Change*> kept;
  for (Change* change : changes) {
    if (!others_.by_id.contains(change->id())) kept.push_back(change);
  }
  if (status.ok() && !kept.empty()) {
    const SharedBatch next = {batch_ + 1, NumberChanges(kept, revision_), AddedBy(kept)};
    std::vector<Statement> statements = StatementsOf(kept);
    statements.push_back(ChangesRow(kept, next.number));
    statements.push_back(
        {.name = "hulld_put_server", .parameters = {owner_, EncodeBigint(next.number)}});
    if (next.number % kBatchesPerPruning == 0 && next.number > kKeptBatches) {
      statements.push_back(
          {.name = "hulld_prune", .parameters = {EncodeBigint(next.number - kKeptBatches)}});
    }
    statements.push_back(Fence(next.revision, next.number, next.added));
    statements.push_back({.text = "COMMIT"});
    writer_->TakeWarned();
    *batch = next;
    status = writer_->Ask(statements).status();
    if (status.ok() && writer_->TakeWarned()) {
      // As when somebody ended the wait for a standby: it is committed, but not where it was to be.
      writer_ = nullptr;
      return absl::Status(absl::StatusCode::kUnavailable, "PostgreSQL warned while it committed");
    }
    if (status.ok()) {
      KeepShared(next);
      return status;
    }
  }
  GiveTurnBack(status);
  return status;
}

// Revisions that were told are given to other changes from now on, so this is another store.
void PostgresStore::GiveNewId() {
  went_back_ = false;
  const absl::StatusOr<std::unique_ptr<Session>> session = OpenWriter();
  const absl::Status status =
      session.ok() ? (*session)->Ask({.name = "hulld_rename", .parameters = {RandomId()}}).status()
                   : session.status();
  if (!status.ok()) spdlog::error("cannot give it a new ID: {}", std::string(status.message()));
}

void PostgresStore::KeepShared(const SharedBatch& batch) {
  batch_ = batch.number;
  seen_batch_ = batch_;
  revision_ = batch.revision;
  totals_ = {totals_.hulls + batch.added.hulls, totals_.vertices + batch.added.vertices,
             totals_.bodies + batch.added.bodies};
  if (notices_ != nullptr) notices_->Send(batch.number);
}

// Whether our batch was committed. Takes the turn: the transaction that had it has ended then, and
// nothing of it can follow, as its COMMIT was sent before. Its own sync takes along what was
// committed before.
absl::StatusOr<bool> PostgresStore::SharedOutcome(uint64_t batch) {
  absl::StatusOr<std::unique_ptr<Session>> session = OpenWriter();
  if (!session.ok()) return session.status();
  writer_ = *std::move(session);
  std::vector<Statement> statements;
  statements.push_back({.text = "BEGIN"});
  statements.push_back({.name = "hulld_touch", .parameters = {EncodeBigint(epoch())}});
  statements.push_back({.name = "hulld_server", .parameters = {owner_}});
  statements.push_back({.text = "COMMIT"});
  const absl::StatusOr<std::vector<Rows>> rows = writer_->Ask(statements);
  if (!rows.ok()) return rows.status();
  if (writer_->TakeWarned()) return absl::UnavailableError("PostgreSQL warned while it committed");
  const Rows& last = (*rows)[2];
  return last.count() == 1 && last.bigint(0, 0) == batch;
}

absl::Status PostgresStore::CommitShared(std::span<Change* const> changes) {
  if (absl::Status s = ended(); !s.ok()) return s;
  const Clock::time_point deadline = Clock::now() + options_.patience;
  for (auto pause = kFirstPause;; pause = std::min(2 * pause, kLongestPause)) {
    absl::Status status;
    SharedBatch batch;
    if (writer_ == nullptr) {
      absl::StatusOr<std::unique_ptr<Session>> session = OpenWriter();
      status = session.status();
      if (session.ok()) writer_ = *std::move(session);
    }
    if (status.ok()) status = AttemptShared(changes, &batch);
    if (status.ok()) return status;
    if (absl::Status s = ended(); !s.ok()) return WriteFailed(s);
    if (ViolatedConstraint(status) == "store_fence") {
      End(Superseded(""));
      return WriteFailed(ended());
    }
    if (!SqlState(status).empty()) return WriteFailed(Refused(status));
    if (batch.number != 0) {
      const absl::StatusOr<bool> committed = FindSharedOutcome(batch.number, deadline);
      if (!committed.ok()) return WriteFailed(OutcomeUnknown(status));
      spdlog::warn("the database was lost while it committed ({}); the batch was {}",
                   std::string(status.message()), *committed ? "committed" : "not committed");
      if (*committed) {
        KeepShared(batch);
        return absl::OkStatus();
      }
    }
    if (Clock::now() + pause >= deadline) return WriteFailed(Refused(status));
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, pause, [this] { return ending_; })) {
      return WriteFailed(Refused(status));
    }
  }
}

absl::StatusOr<bool> PostgresStore::FindSharedOutcome(uint64_t batch, Clock::time_point deadline) {
  for (auto pause = kFirstPause;; pause = std::min(2 * pause, kLongestPause)) {
    const absl::StatusOr<bool> outcome = SharedOutcome(batch);
    if (outcome.ok()) return outcome;
    writer_ = nullptr;
    if (ViolatedConstraint(outcome.status()) == "store_fence") End(Superseded(""));
    if (!ended().ok() || Clock::now() + pause >= deadline) return outcome;
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, pause, [this] { return ending_; })) return outcome;
  }
}

// Ends sessions that hold the turn and send nothing, as those of a server that stands still in the
// middle of sending a batch do: PostgreSQL bounds how long it waits between transactions and
// between batches of statements, but not within these.
absl::Status PostgresStore::EndStuckTurns() {
  return keeper_session_
      ->Run(absl::StrCat(
          "SELECT pg_terminate_backend(a.pid) FROM pg_locks l JOIN pg_stat_activity a USING (pid) "
          "WHERE l.relation = 'hulld.store'::regclass AND l.mode = 'RowShareLock' AND l.granted "
          "AND a.datname = current_database() AND a.usename = current_user "
          "AND a.wait_event = 'ClientRead' AND a.state_change < now() - interval '",
          options_.longest_send.count(), " ms'"))
      .status();
}

void PostgresStore::StartNotices() {
  const auto on_batch = [this](uint64_t batch) {
    if (batch > seen_batch_) TellOfOthers();
  };
  notices_ = std::make_unique<BatchNotices>(
      [this] { return OpenListener(); }, options_.beat, on_batch,
      absl::StrCat("it is asked for that every ", options_.look.count(), " ms"));
}

// Whether notices come. The keeper looks at the store with each beat all the same; what it found
// then, and nobody told it by now, was lost: then it looks more often, until it hears again.
bool PostgresStore::HearsOthers() const {
  return notices_ != nullptr && notices_->is_listening() && notices_->last_heard() >= looked_at_;
}

// Whether others have committed since this knew what they did; then it is told.
absl::Status PostgresStore::LookForOthers() {
  const absl::StatusOr<uint64_t> batch = LastBatch(*keeper_session_);
  if (!batch.ok()) return batch.status();
  looked_at_ = *batch;
  if (*batch != seen_batch_) TellOfOthers();
  return absl::OkStatus();
}

// With the mutex, so that OnOthers waits until nobody calls the former one.
void PostgresStore::TellOfOthers() {
  const std::lock_guard lock(mutex_);
  if (on_others_) on_others_();
}

void PostgresStore::OnOthers(std::function<void()> others) {
  const std::lock_guard lock(mutex_);
  on_others_ = std::move(others);
}

// The sequence, and whether the hull is still what it was known to be: the two are of one moment.
absl::StatusOr<std::string> PostgresStore::ReadSequence(const HullRecord& hull,
                                                        const std::string& writer_id) {
  std::vector<Statement> statements(1);
  statements[0] = {.name = "hulld_sequence_and_record",
                   .parameters = {hull.hull_id, EncodeBigint(hull.create_revision), writer_id}};
  const absl::StatusOr<std::vector<Rows>> rows = Read(std::move(statements));
  if (!rows.ok()) return rows.status();
  const Rows& row = rows->front();
  if (row.count() == 0) return Moved();
  const absl::StatusOr<StoredHull> now = UnsealStoredHull(hull.hull_id, row.at(0, 1));
  if (!now.ok()) return now.status();
  if (now->record != hull) return Moved();
  return std::string(row.at(0, 0));
}

// Whether the vertices that were read, and are not what the record says, are those of a hull that
// another server changed since. ABORTED: they are.
absl::Status PostgresStore::WhyDamaged(const StoredHull& hull, const absl::Status& damage) {
  std::vector<Statement> statements(1);
  statements[0] = {.name = "hulld_record", .parameters = {hull.record.hull_id}};
  const absl::StatusOr<std::vector<Rows>> rows = Read(std::move(statements));
  if (!rows.ok()) return rows.status();
  if (rows->front().count() == 0) return Moved();
  const absl::StatusOr<StoredHull> now =
      UnsealStoredHull(hull.record.hull_id, rows->front().at(0, 0));
  if (!now.ok()) return now.status();
  return now->record.revision == hull.record.revision ? damage : Moved();
}

}  // namespace hulld::server
