#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "server/migration/migration_target.h"
#include "server/store/postgres/batch_statements.h"
#include "server/store/postgres/conninfo.h"
#include "server/store/postgres/parameters.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/postgres/session.h"

namespace hulld::server {
namespace {

// Maximum silence of the database while an answer is due.
constexpr std::chrono::milliseconds kAnswerTime{30'000};

// Commits are on disk, regardless of the role's default. For the fence see postgres_store.h.
// Requires that the store's row exists.
constexpr char kPrepare[] = R"(
    SET search_path = '';
    SET synchronous_commit = on;
    PREPARE migrate_fence(bigint) AS UPDATE hulld.store SET written_in = $1;
    PREPARE migrate_count(bigint, bigint, bigint) AS
      UPDATE hulld.store SET hulls = hulls + $1, vertices = vertices + $2, bodies = bodies + $3;
    PREPARE migrate_finish(bigint) AS UPDATE hulld.store SET revision = $1;)";

// The store holds the claim and serves reads; a separate session writes, fenced by the epoch of
// that claim.
class PostgresTarget : public MigrationTarget {
 public:
  PostgresTarget(std::unique_ptr<PostgresStore> store, std::unique_ptr<Session> session)
      : store_(std::move(store)), session_(std::move(session)) {}

  Store& store() override { return *store_; }

  absl::StatusOr<std::optional<MigrationSource>> ReadMark() override {
    const absl::StatusOr<bool> is_marked = HasTable(*session_, "hulld.migration");
    if (!is_marked.ok()) return is_marked.status();
    if (!*is_marked) return std::nullopt;
    const absl::StatusOr<Rows> rows =
        session_->Ask({.text = "SELECT store_id, revision FROM hulld.migration"});
    if (!rows.ok()) return rows.status();
    if (rows->count() != 1) return absl::DataLossError("the row of hulld.migration is missing");
    return MigrationSource{std::string(rows->at(0, 0)), rows->bigint(0, 1)};
  }

  absl::Status Begin(const MigrationSource& source) override {
    std::vector<Statement> statements;
    for (const char* text :
         {"DELETE FROM hulld.hulls", "DELETE FROM hulld.bodies", "DELETE FROM hulld.writers",
          "DELETE FROM hulld.bases", "DELETE FROM hulld.deltas",
          "UPDATE hulld.store SET hulls = 0, vertices = 0, bodies = 0",
          "DROP TABLE IF EXISTS hulld.migration",
          "CREATE TABLE hulld.migration (store_id text NOT NULL, revision bigint NOT NULL)",
          "PREPARE migrate_begin(text, bigint) AS INSERT INTO hulld.migration VALUES ($1, $2)"}) {
      statements.push_back({.text = text});
    }
    statements.push_back(
        {.name = "migrate_begin", .parameters = {source.store_id, EncodeBigint(source.revision)}});
    statements.push_back({.text = "DEALLOCATE migrate_begin"});
    return Transact(std::move(statements));
  }

  absl::Status Add(std::span<const Change* const> changes) override {
    // A hull may take several changes, all in this call; a body takes one.
    std::map<std::string_view, uint64_t> vertices;
    uint64_t bodies = 0;
    for (const Change* change : changes) {
      if (change->body == nullptr) {
        vertices[change->id()] = change->hull.record.vertex_count;
      } else {
        ++bodies;
      }
    }
    uint64_t sum = 0;
    for (const auto& [id, count] : vertices) sum += count;
    std::vector<Statement> statements = StatementsOf(changes);
    statements.push_back(
        {.name = "migrate_count",
         .parameters = {EncodeBigint(vertices.size()), EncodeBigint(sum), EncodeBigint(bodies)}});
    return Transact(std::move(statements));
  }

  absl::Status Finish(const MigrationSource& source) override {
    std::vector<Statement> statements(2);
    statements[0] = {.name = "migrate_finish", .parameters = {EncodeBigint(source.revision)}};
    statements[1] = {.text = "DROP TABLE hulld.migration"};
    return Transact(std::move(statements));
  }

 private:
  absl::Status Transact(std::vector<Statement> statements) {
    std::vector<Statement> all(2);
    all[0] = {.text = "BEGIN"};
    all[1] = {.name = "migrate_fence", .parameters = {EncodeBigint(store_->epoch())}};
    std::ranges::move(statements, std::back_inserter(all));
    all.push_back({.text = "COMMIT"});
    absl::Status status = session_->Ask(all).status();
    if (status.ok()) return status;
    if (ViolatedConstraint(status) == "store_fence") {
      return absl::AbortedError(
          "a server took over the database; stop it, then run this command again");
    }
    return absl::Status(status.code(), absl::StrCat("the database: ", status.message()));
  }

  // Declared before the session, which must end without waiting for the claim's end.
  const std::unique_ptr<PostgresStore> store_;
  const std::unique_ptr<Session> session_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenPostgresTarget(const std::string& conninfo) {
  const absl::StatusOr<Conninfo> parsed = Conninfo::Parse(conninfo);
  if (!parsed.ok()) return parsed.status();
  PostgresOptions options;
  options.conninfo = conninfo;
  options.migrating = true;
  options.should_stop = [] { return true; };
  absl::StatusOr<std::unique_ptr<PostgresStore>> store = PostgresStore::Open(std::move(options));
  if (!store.ok()) return store.status();
  absl::StatusOr<std::unique_ptr<Session>> session = Session::Open(*parsed, kAnswerTime);
  if (!session.ok()) return session.status();
  const absl::Status prepared =
      (*session)->Run(absl::StrCat(kPrepare, PrepareBatchStatements())).status();
  if (!prepared.ok()) return prepared;
  return std::make_unique<PostgresTarget>(*std::move(store), *std::move(session));
}

}  // namespace hulld::server
