#ifndef HULLD_SERVER_STORE_POSTGRES_SESSION_H_
#define HULLD_SERVER_STORE_POSTGRES_SESSION_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <libpq-fe.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/store/postgres/conninfo.h"
#include "server/store/postgres/parameters.h"

namespace hulld::server {

// Result of a statement.
class Rows {
 public:
  explicit Rows(PGresult* result) : result_(result, PQclear) {}

  int count() const { return PQntuples(result_.get()); }
  // The value as received: text from Run, binary from Ask.
  std::string_view at(int row, int column) const {
    return {PQgetvalue(result_.get(), row, column),
            static_cast<size_t>(PQgetlength(result_.get(), row, column))};
  }
  uint64_t bigint(int row, int column) const { return DecodeBigint(at(row, column)); }

 private:
  std::unique_ptr<PGresult, decltype(&PQclear)> result_;
};

// True if the session ended or did not answer in time: its last operation may or may not have taken
// effect, or may still do so.
bool IsLost(const absl::Status& status);
// PostgreSQL's code of an error that it returned, as "42501"; otherwise empty.
std::string SqlState(const absl::Status& status);
// The constraint violated by a statement; otherwise empty.
std::string ViolatedConstraint(const absl::Status& status);

// A connection to PostgreSQL, used by one thread at a time. Errors are UNAVAILABLE, or
// RESOURCE_EXHAUSTED if PostgreSQL's disk is full. After a session is lost (IsLost), all later
// operations fail in the same way.
class Session {
 public:
  // answer_time: maximum silence while an answer is due; the session is lost after it.
  static absl::StatusOr<std::unique_ptr<Session>> Open(const Conninfo& conninfo,
                                                       std::chrono::milliseconds answer_time);

  // Runs statements without parameters, separated by semicolons; returns the rows of the last, as
  // text.
  absl::StatusOr<Rows> Run(const std::string& text);
  // Runs all statements in one round trip. The first failure ends it, and is the error; an open
  // transaction then stays open, but cannot be committed.
  absl::StatusOr<std::vector<Rows>> Ask(std::span<const Statement> statements);
  absl::StatusOr<Rows> Ask(Statement statement);
  // The two halves of Ask: send and receive. Start does not block; Finish must be the next call, on
  // any thread.
  absl::Status Start(std::span<const Statement> statements);
  absl::StatusOr<std::vector<Rows>> Finish();

  // Waits until data arrives from the database, `wake` is readable, or `longest` has passed;
  // negative: no limit. wake: a file descriptor.
  absl::Status AwaitNotices(int wake, std::chrono::milliseconds longest);
  // Returns the payloads of the notices (LISTEN) received since the last call.
  std::vector<std::string> TakeNotices();

  // As Ask for statements that commit. A warning counts as a loss: for example, the wait for a
  // standby was interrupted, so the transaction is committed, but not replicated as required.
  absl::StatusOr<std::vector<Rows>> AskToCommit(std::span<const Statement> statements);
  // Returns the version of the server: 150018 for 15.18.
  int server_version() const { return PQserverVersion(connection_.get()); }
  // Describes the location without secrets: "database hulld at db.example".
  std::string Describe() const;

 private:
  Session(PGconn* connection, std::chrono::milliseconds answer_time);
  static void NoteWarning(void* session, const PGresult* result);

  absl::Status Lost(const std::string& what);
  absl::Status Send(const Statement& statement);
  absl::Status AwaitResult();
  absl::StatusOr<PGresult*> NextResult();
  absl::Status ErrorOf(const PGresult* result);

  const std::unique_ptr<PGconn, decltype(&PQfinish)> connection_;
  const std::chrono::milliseconds answer_time_;
  absl::Status lost_;
  bool warned_ = false;
};

// Returns the number in the only row of a query about the store. DATA_LOSS: the row is missing.
absl::StatusOr<uint64_t> OnlyNumber(const absl::StatusOr<Rows>& rows);

// Returns true if a table exists. name: as in "hulld.store".
absl::StatusOr<bool> HasTable(Session& session, const std::string& name);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_SESSION_H_
