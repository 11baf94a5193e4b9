#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/migration/migration_target.h"
#include "server/store/postgres/batch_statements.h"
#include "server/store/postgres/conninfo.h"
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
    PREPARE migrate_fence(bigint, bigint, bigint, bigint) AS
      UPDATE hulld.store SET written_in = $1, hulls = hulls + $2, vertices = vertices + $3,
        bodies = bodies + $4;
    PREPARE migrate_finish(bigint) AS UPDATE hulld.store SET revision = $1;)";

// The store holds the claim and serves reads; a separate session writes, fenced by the epoch of
// that claim.
class PostgresTarget : public MigrationTarget {
 public:
  PostgresTarget(std::unique_ptr<PostgresStore> store, std::unique_ptr<Session> session)
      : store_(std::move(store)), session_(std::move(session)) {}

  Store& store() override { return *store_; }

  absl::StatusOr<std::optional<MigrationSource>> ReadMark() override {
    HULLD_ASSIGN_OR_RETURN(const bool is_marked, HasTable(*session_, "hulld.migration"));
    if (!is_marked) return std::nullopt;
    HULLD_ASSIGN_OR_RETURN(
        const Rows rows, session_->Ask({.text = "SELECT store_id, revision FROM hulld.migration"}));
    if (rows.count() != 1) return absl::DataLossError("the row of hulld.migration is missing");
    return MigrationSource{std::string(rows.at(0, 0)), rows.bigint(0, 1)};
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
    return Transact(std::move(statements), {});
  }

  absl::Status Add(std::span<const Change* const> changes) override {
    return Transact(StatementsOf(changes), AddedBy(changes));
  }

  absl::Status Finish(const MigrationSource& source) override {
    std::vector<Statement> statements(2);
    statements[0] = {.name = "migrate_finish", .parameters = {EncodeBigint(source.revision)}};
    statements[1] = {.text = "DROP TABLE hulld.migration"};
    return Transact(std::move(statements), {});
  }

 private:
  // added: change of the store's totals.
  absl::Status Transact(std::vector<Statement> statements, const StoreTotals& added) {
    std::vector<Statement> all(2);
    all[0] = {.text = "BEGIN"};
    all[1] = {.name = "migrate_fence",
              .parameters = {EncodeBigint(store_->epoch()), EncodeBigint(added.hulls),
                             EncodeBigint(added.vertices), EncodeBigint(added.bodies)}};
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
  HULLD_ASSIGN_OR_RETURN(const Conninfo parsed, Conninfo::Parse(conninfo));
  PostgresOptions options;
  options.conninfo = conninfo;
  options.migrating = true;
  options.should_stop = [] { return true; };
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<PostgresStore> store,
                         PostgresStore::Open(std::move(options)));
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<Session> session, Session::Open(parsed, kAnswerTime));
  HULLD_RETURN_IF_ERROR(session->Run(absl::StrCat(kPrepare, PrepareBatchStatements())).status());
  return std::make_unique<PostgresTarget>(std::move(store), std::move(session));
}

}  // namespace hulld::server
