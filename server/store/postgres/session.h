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

// What one statement answered.
class Rows {
 public:
  explicit Rows(PGresult* result) : result_(result, PQclear) {}

  int count() const { return PQntuples(result_.get()); }
  // As the session sent it: text after Run, binary after Ask.
  std::string_view at(int row, int column) const {
    return {PQgetvalue(result_.get(), row, column),
            static_cast<size_t>(PQgetlength(result_.get(), row, column))};
  }
  uint64_t bigint(int row, int column) const { return DecodeBigint(at(row, column)); }

 private:
  std::unique_ptr<PGresult, decltype(&PQclear)> result_;
};

// Whether the session ended, or did not answer in time: what it was doing may have been done, not
// have been done, or be done later.
bool IsLost(const absl::Status& status);
// PostgreSQL's code of an error that it answered, as "42501"; empty for others.
std::string SqlState(const absl::Status& status);
// The constraint that a statement violated; empty for others.
std::string ViolatedConstraint(const absl::Status& status);

// A connection to PostgreSQL. One thread at a time. Errors are UNAVAILABLE, and RESOURCE_EXHAUSTED
// where PostgreSQL's disk is full; once one is lost (IsLost), so are all that follow.
class Session {
 public:
  // answer_time: how long nothing may come or go while an answer is due; then the session is lost.
  static absl::StatusOr<std::unique_ptr<Session>> Open(const Conninfo& conninfo,
                                                       std::chrono::milliseconds answer_time);

  // Statements without parameters, separated by semicolons; the rows of the last, as text.
  absl::StatusOr<Rows> Run(const std::string& text);
  // All statements in one round trip. The first that fails ends it, and is the error; a transaction
  // that they began stays open then, without being able to commit.
  absl::StatusOr<std::vector<Rows>> Ask(std::span<const Statement> statements);
  absl::StatusOr<Rows> Ask(Statement statement);
  // The two halves of Ask: what is sent, and what comes of it. Start waits for nothing; Finish is
  // next after it, on any thread.
  absl::Status Start(std::span<const Statement> statements);
  absl::StatusOr<std::vector<Rows>> Finish();

  // Waits until something comes from the database, `wake` can be read, or `longest` is over;
  // negative: never. wake: a file descriptor.
  absl::Status AwaitNotices(int wake, std::chrono::milliseconds longest);
  // The payloads of the notices that came (LISTEN) since this was asked last.
  std::vector<std::string> TakeNotices();

  // Whether PostgreSQL warned of anything since this was asked last.
  bool TakeWarned() { return std::exchange(warned_, false); }
  // As in 150018.
  int server_version() const { return PQserverVersion(connection_.get()); }
  // Where it is, without secrets: "database hulld at db.example".
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

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_SESSION_H_
