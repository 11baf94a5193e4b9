#ifndef HULLD_SERVER_STORE_POSTGRES_SESSION_H_
#define HULLD_SERVER_STORE_POSTGRES_SESSION_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <libpq-fe.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/store/store_keys.h"

namespace hulld::server {

// Connection parameters of a database by keyword, for PQconnectdbParams. They may include
// passwords, so no error or log line quotes the text; libpq's own errors name host, port, user and
// database.
using Conninfo = std::map<std::string, std::string>;

// text: a connection string of libpq, keywords with values or a URI. Missing keywords get defaults
// that bound the wait for an unreachable machine and select a writable server. INVALID_ARGUMENT,
// without quoting the text: it is not a connection string, or a password in it ends early, so that
// its rest would be parsed as a host or a database.
absl::StatusOr<Conninfo> ParseConninfo(const std::string& text);

// Encodes a bigint in PostgreSQL's binary format. Revisions and other numbers stay below 2^63.
inline std::string EncodeBigint(uint64_t number) { return BigEndian(number); }
inline uint64_t DecodeBigint(std::string_view bytes) { return FromBigEndian(bytes); }
// Encodes an integer in the same way.
inline std::string EncodeInteger(uint32_t number) { return BigEndian(number); }

// A one-dimensional array in PostgreSQL's binary format.
class ArrayParameter {
 public:
  enum class Element : uint32_t { kBytea = 17, kBigint = 20, kInteger = 23, kText = 25 };

  explicit ArrayParameter(Element element) : element_(element) {}
  // value: the element in binary format.
  void Add(std::string_view value);
  uint32_t count() const { return count_; }
  size_t bytes() const { return elements_.size(); }
  // Returns the array and clears it.
  std::string Take();

 private:
  Element element_;
  uint32_t count_ = 0;
  std::string elements_;
};

// A statement: the name of a prepared one, or the text of a statement without parameters.
struct Statement {
  const char* name = nullptr;
  const char* text = nullptr;
  // In binary format.
  std::vector<std::string> parameters = {};
};

// Result of a statement.
class Rows {
 public:
  explicit Rows(PGresult* result) : result_(result, PQclear) {}

  int count() const { return PQntuples(result_.get()); }
  // The value as received: text from Run, binary from Execute.
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
  // answer_timeout: maximum silence while an answer is due; the session is lost after it.
  static absl::StatusOr<std::unique_ptr<Session>> Open(const Conninfo& conninfo,
                                                       std::chrono::milliseconds answer_timeout);

  // Runs statements without parameters, separated by semicolons; returns the rows of the last, as
  // text.
  absl::StatusOr<Rows> Run(const std::string& text);
  // Runs all statements in one round trip. The first failure ends it, and is the error; an open
  // transaction then stays open, but cannot be committed.
  absl::StatusOr<std::vector<Rows>> Execute(std::span<const Statement> statements);
  absl::StatusOr<Rows> Execute(Statement statement);
  // The two halves of Execute: send and receive. Start does not block; Finish must be the next
  // call, on any thread.
  absl::Status Start(std::span<const Statement> statements);
  absl::StatusOr<std::vector<Rows>> Finish();

  // Waits until data arrives from the database, `wake` is readable, or `longest` has passed;
  // negative: no limit. wake: a file descriptor.
  absl::Status AwaitNotices(int wake, std::chrono::milliseconds longest);
  // Returns the payloads of the notices (LISTEN) received since the last call.
  std::vector<std::string> TakeNotices();

  // Like Execute for statements that commit. A warning counts as a loss: for example, the wait for
  // a standby was interrupted, so the transaction is committed, but not replicated as required.
  absl::StatusOr<std::vector<Rows>> ExecuteCommit(std::span<const Statement> statements);
  // Returns the version of the server: 150018 for 15.18.
  int server_version() const { return PQserverVersion(connection_.get()); }
  // Describes the location without secrets: "database hulld at db.example".
  std::string Describe() const;

 private:
  Session(PGconn* connection, std::chrono::milliseconds answer_timeout);
  static void NoteWarning(void* session, const PGresult* result);

  absl::Status Lost(const std::string& what);
  absl::Status Send(const Statement& statement);
  absl::Status AwaitResult();
  absl::StatusOr<PGresult*> NextResult();
  absl::Status ErrorOf(const PGresult* result);

  const std::unique_ptr<PGconn, decltype(&PQfinish)> connection_;
  const std::chrono::milliseconds answer_timeout_;
  absl::Status lost_;
  bool warned_ = false;
};

// Sessions shared by threads; each is used by one thread at a time. Thread-safe.
class SessionPool {
 public:
  using Opener = std::function<absl::StatusOr<std::unique_ptr<Session>>()>;

  // open: creates a session. max_sessions: a thread waits if this many are in use.
  SessionPool(Opener open, int max_sessions)
      : open_(std::move(open)), max_sessions_(max_sessions) {}

  // Session::Execute on one of the sessions. If it was lost since its last use, for example by a
  // restart of the database, retries once on a new one.
  absl::StatusOr<std::vector<Rows>> Execute(std::span<const Statement> statements);

  // The two halves of Execute. TryStart does not block: returns null if no session is idle. A
  // started query must be finished or dropped, on any thread, before the next one if there is only
  // one session.
  std::unique_ptr<Session> TryStart(std::span<const Statement> statements);
  // statements: as passed to TryStart.
  absl::StatusOr<std::vector<Rows>> Finish(std::unique_ptr<Session> session,
                                           std::span<const Statement> statements);
  void Drop(std::unique_ptr<Session> session) {
    if (session != nullptr) Return(nullptr);
  }

 private:
  absl::StatusOr<std::unique_ptr<Session>> Take(bool fresh);
  void Return(std::unique_ptr<Session> session);

  const Opener open_;
  const int max_sessions_;
  std::mutex mutex_;
  std::condition_variable free_;
  // Guarded by mutex_.
  std::vector<std::unique_ptr<Session>> idle_;
  int taken_ = 0;
};

// Returns the number in the only row of a query about the store. DATA_LOSS: the row is missing.
absl::StatusOr<uint64_t> SingleNumber(const absl::StatusOr<Rows>& rows);

// Returns true if a table exists. name: as in "hulld.store".
absl::StatusOr<bool> HasTable(Session& session, const std::string& name);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_SESSION_H_
