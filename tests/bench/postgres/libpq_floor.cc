#include "tests/bench/postgres/libpq_floor.h"

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace hulld::bench {
namespace {

constexpr uint32_t kBytea = 17;
constexpr uint32_t kBigint = 20;
constexpr uint32_t kText = 25;
constexpr uint64_t kMaxFollowed = 1 << 17;
constexpr uint64_t kBatchesPerPruning = 1 << 10;

// Same as in hulld's sessions (server/store/postgres).
constexpr char kPrepare[] = R"(
  SET search_path = '';
  SET enable_seqscan = off;
  SET jit = off;
  SET synchronous_commit = on;
  PREPARE fence(bigint, bigint, bigint) AS
    UPDATE hulld.store SET revision = $1, batch = $2, written_in = $3;
  PREPARE put_hulls(text[], bytea[]) AS
    INSERT INTO hulld.hulls (hull_id, record) SELECT * FROM unnest($1, $2)
    ON CONFLICT (hull_id) DO UPDATE SET record = excluded.record;
  PREPARE put_writers(text[], bigint[], text[], bytea[]) AS
    INSERT INTO hulld.writers (hull_id, incarnation, writer_id, sequence)
    SELECT * FROM unnest($1, $2, $3, $4)
    ON CONFLICT (hull_id, incarnation, writer_id) DO UPDATE SET sequence = excluded.sequence;
  PREPARE put_deltas(text[], bigint[], bigint[], bytea[]) AS
    INSERT INTO hulld.deltas (hull_id, incarnation, revision, vertices)
    SELECT * FROM unnest($1, $2, $3, $4);)";

constexpr char kPrepareShared[] = R"(
  PREPARE turn AS SELECT batch FROM hulld.store FOR UPDATE;
  PREPARE follow(bigint, bigint) AS
    SELECT s.batch, s.revision, s.epoch, s.pruned, s.owner, c.id, c.revision, c.ended_at,
      h.record, b.body, s.store_id
    FROM hulld.store s
    LEFT JOIN (
      SELECT id, max(revision) AS revision, max(ended_at) AS ended_at
      FROM hulld.changes WHERE batch > $1 GROUP BY id LIMIT $2) c ON true
    LEFT JOIN hulld.hulls h ON h.hull_id = c.id
    LEFT JOIN hulld.bodies b ON b.body_id = c.id;
  PREPARE put_changes(bigint, text[], bigint[], bigint[]) AS
    INSERT INTO hulld.changes (batch, id, revision, ended_at)
    SELECT $1, * FROM unnest($2, $3, $4);
  PREPARE put_server(text, bigint) AS
    INSERT INTO hulld.servers (owner, batch) VALUES ($1, $2)
    ON CONFLICT (owner) DO UPDATE SET batch = excluded.batch;
  PREPARE prune(bigint) AS
    WITH pruned AS (UPDATE hulld.store SET pruned = $1)
    DELETE FROM hulld.changes WHERE batch <= $1;)";

[[noreturn]] void Fail(const std::string& what) {
  std::fprintf(stderr, "libpq: %s\n", what.c_str());
  std::exit(1);
}

std::string BigEndian(uint64_t number, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text.push_back(static_cast<char>(number >> (8 * i)));
  return text;
}

std::string Bigint(uint64_t number) { return BigEndian(number, 8); }

// Returns a single-element array, in PostgreSQL's binary format.
std::string Array(uint32_t type, std::string_view element) {
  std::string text;
  for (const uint32_t field : {1U, 0U, type, 1U, 1U, static_cast<uint32_t>(element.size())}) {
    text += BigEndian(field, 4);
  }
  return text.append(element);
}

// "\x0a1b", as psql shows it.
std::string Bytes(const std::string& hex) {
  std::string bytes;
  for (size_t i = 2; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

std::string FirstValue(PGconn* connection, const std::string& statement) {
  PGresult* const result = PQexec(connection, statement.c_str());
  const ExecStatusType status = PQresultStatus(result);
  if (status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK) {
    Fail(statement + ": " + PQerrorMessage(connection));
  }
  const std::string value = PQntuples(result) > 0 ? PQgetvalue(result, 0, 0) : "";
  PQclear(result);
  return value;
}

}  // namespace

std::string RunSql(const std::string& conninfo, const std::string& statement) {
  const std::unique_ptr<PGconn, decltype(&PQfinish)> connection(PQconnectdb(conninfo.c_str()),
                                                                PQfinish);
  if (PQstatus(connection.get()) != CONNECTION_OK) Fail(PQerrorMessage(connection.get()));
  PQsetNoticeProcessor(
      connection.get(), [](void*, const char*) {}, nullptr);
  return FirstValue(connection.get(), statement);
}

LibpqFloor::LibpqFloor(const std::string& conninfo, const std::string& hull_id, bool shared)
    : shared_(shared), hull_id_(hull_id), connection_(PQconnectdb(conninfo.c_str()), PQfinish) {
  if (PQstatus(connection_.get()) != CONNECTION_OK) Fail(PQerrorMessage(connection_.get()));
  Run(kPrepare);
  if (shared_) Run(kPrepareShared);
  epoch_ = std::stoull(Value("SELECT epoch FROM hulld.store"));
  batch_ = std::stoull(Value("SELECT batch FROM hulld.store"));
  revision_ = std::stoull(Value("SELECT revision FROM hulld.store"));
  const std::string of_hull = " WHERE hull_id = '" + hull_id + "' LIMIT 1";
  record_ = Bytes(Value("SELECT record FROM hulld.hulls" + of_hull));
  incarnation_ = std::stoull(Value("SELECT incarnation FROM hulld.deltas" + of_hull));
  delta_ = Bytes(Value("SELECT vertices FROM hulld.deltas" + of_hull));
  writer_id_ = Value("SELECT writer_id FROM hulld.writers" + of_hull);
  sequence_ = Bytes(Value("SELECT sequence FROM hulld.writers" + of_hull));
}

void LibpqFloor::Run(const std::string& text) { Value(text); }

std::string LibpqFloor::Value(const std::string& query) {
  return FirstValue(connection_.get(), query);
}

void LibpqFloor::Execute(const std::vector<Statement>& statements) {
  constexpr int kBinary = 1;
  PGconn* const connection = connection_.get();
  if (PQenterPipelineMode(connection) == 0) Fail(PQerrorMessage(connection));
  for (const Statement& statement : statements) {
    std::vector<const char*> values;
    std::vector<int> lengths;
    for (const std::string& parameter : statement.parameters) {
      values.push_back(parameter.data());
      lengths.push_back(static_cast<int>(parameter.size()));
    }
    const std::vector<int> formats(values.size(), kBinary);
    const int count = static_cast<int>(values.size());
    // Statements without parameters are not prepared, as in hulld.
    const bool is_text =
        std::string_view(statement.name) == "BEGIN" || std::string_view(statement.name) == "COMMIT";
    const int sent = is_text ? PQsendQueryParams(connection, statement.name, 0, nullptr, nullptr,
                                                 nullptr, nullptr, kBinary)
                             : PQsendQueryPrepared(connection, statement.name, count, values.data(),
                                                   lengths.data(), formats.data(), kBinary);
    if (sent == 0) Fail(PQerrorMessage(connection));
  }
  if (PQpipelineSync(connection) == 0) Fail(PQerrorMessage(connection));
  for (bool synced = false; !synced;) {
    PGresult* const result = PQgetResult(connection);
    if (result == nullptr) continue;  // the end of one statement's results
    const ExecStatusType status = PQresultStatus(result);
    synced = status == PGRES_PIPELINE_SYNC;
    if (!synced && status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) {
      Fail(PQresultErrorMessage(result));
    }
    PQclear(result);
  }
  PQexitPipelineMode(connection);
}

std::vector<LibpqFloor::Statement> LibpqFloor::Puts() const {
  return {{"put_hulls", {Array(kText, hull_id_), Array(kBytea, record_)}},
          {"put_writers",
           {Array(kText, hull_id_), Array(kBigint, Bigint(incarnation_)), Array(kText, writer_id_),
            Array(kBytea, sequence_)}},
          {"put_deltas",
           {Array(kText, hull_id_), Array(kBigint, Bigint(incarnation_)),
            Array(kBigint, Bigint(revision_)), Array(kBytea, delta_)}}};
}

LibpqFloor::Statement LibpqFloor::Fence() const {
  return {"fence", {Bigint(revision_), Bigint(batch_), Bigint(epoch_)}};
}

LibpqFloor::Statement LibpqFloor::FetchPeerChanges() const {
  return {"follow", {Bigint(batch_), Bigint(kMaxFollowed + 1)}};
}

void LibpqFloor::Commit() {
  std::vector<Statement> statements = {{"BEGIN"}};
  if (shared_) {
    Execute({{"BEGIN"}, {"turn"}, FetchPeerChanges()});
    statements.clear();
  }
  ++batch_;
  ++revision_;
  if (!shared_) statements.push_back(Fence());
  for (Statement& put : Puts()) statements.push_back(std::move(put));
  if (shared_) {
    statements.push_back({"put_changes",
                          {Bigint(batch_), Array(kText, hull_id_),
                           Array(kBigint, Bigint(revision_)), Array(kBigint, Bigint(0))}});
    statements.push_back({"put_server", {"libpq, as a server would name itself", Bigint(batch_)}});
    if (batch_ % kBatchesPerPruning == 0) statements.push_back({"prune", {Bigint(0)}});
    statements.push_back(Fence());
  }
  statements.push_back({"COMMIT"});
  Execute(statements);
}

void LibpqFloor::Follow() { Execute({FetchPeerChanges()}); }

}  // namespace hulld::bench
