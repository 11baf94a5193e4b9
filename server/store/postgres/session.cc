#include "server/store/postgres/session.h"

#include <absl/strings/ascii.h>
#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <poll.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

constexpr char kLostPayload[] = "hulld/postgres/lost";
constexpr char kStatePayload[] = "hulld/postgres/sqlstate";
constexpr char kConstraintPayload[] = "hulld/postgres/constraint";
constexpr char kDiskFull[] = "53100";

std::string PayloadOf(const absl::Status& status, const char* name) {
  const absl::optional<absl::Cord> payload = status.GetPayload(name);
  return payload.has_value() ? std::string(*payload) : "";
}

// libpq's messages end with a newline, and some have several lines.
std::string OneLine(const char* message) {
  return absl::StrReplaceAll(absl::StripAsciiWhitespace(message), {{"\n\t", " "}, {"\n", "; "}});
}

std::string FieldOf(const PGresult* result, int field) {
  const char* const text = PQresultErrorField(result, field);
  return text == nullptr ? "" : text;
}

bool IsError(const PGresult* result) {
  switch (PQresultStatus(result)) {
    case PGRES_COMMAND_OK:
    case PGRES_TUPLES_OK:
    case PGRES_EMPTY_QUERY:
    case PGRES_PIPELINE_SYNC:
      return false;
    default:
      return true;
  }
}

// Defaults for missing keywords. Times are in seconds, or in milliseconds for TCP: longer than a
// network glitch, but shorter than an operator's patience. Not tuned.
constexpr struct {
  const char* keyword;
  const char* value;
} kDefaults[] = {
    {"fallback_application_name", "hulld"},
    {"client_encoding", "UTF8"},
    {"connect_timeout", "5"},
    {"keepalives_idle", "5"},
    {"keepalives_interval", "2"},
    {"keepalives_count", "3"},
    {"tcp_user_timeout", "10000"},
    {"target_session_attrs", "read-write"},
};

}  // namespace

absl::StatusOr<Conninfo> ParseConninfo(const std::string& text) {
  const std::string trimmed(absl::StripAsciiWhitespace(text));
  if (trimmed.empty()) return InvalidArgument("it is empty");
  // libpq's message would quote the text.
  char* words = nullptr;
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> options(
      PQconninfoParse(trimmed.c_str(), &words), PQconninfoFree);
  PQfreemem(words);
  if (options == nullptr) {
    return InvalidArgument(
        "it is not a libpq connection string, such as 'host=db.example dbname=hulld user=hulld "
        "password=...' (a value with spaces in single quotes) or "
        "'postgresql://hulld@db.example/hulld'");
  }
  Conninfo conninfo;
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    if (option->val != nullptr) conninfo[option->keyword] = option->val;
  }
  for (const auto& [keyword, value] : kDefaults) conninfo.emplace(keyword, value);
  const auto holds = [&](const char* keyword, const char* forbidden, bool only) {
    const auto found = conninfo.find(keyword);
    if (found == conninfo.end()) return false;
    return (only ? found->second.find_first_not_of(forbidden)
                 : found->second.find_first_of(forbidden)) != std::string::npos;
  };
  if (holds("host", "@", false) || holds("dbname", "@", false) ||
      holds("port", "0123456789,", true)) {
    return InvalidArgument(
        "its host or database contains an @, or its port is not a number; in the password of a "
        "URI, write @ as %40 and / as %2F");
  }
  return conninfo;
}

void ArrayParameter::Add(std::string_view value) {
  ++count_;
  elements_ += EncodeInteger(static_cast<uint32_t>(value.size()));
  elements_ += value;
}

// Header: number of dimensions, null flag, element type; then, per dimension, its length and its
// first index. Source: array_recv in PostgreSQL's utils/adt/arrayfuncs.c.
std::string ArrayParameter::Take() {
  return absl::StrCat(
      EncodeInteger(1), EncodeInteger(0), EncodeInteger(static_cast<uint32_t>(element_)),
      EncodeInteger(std::exchange(count_, 0)), EncodeInteger(1), std::exchange(elements_, {}));
}

bool IsLost(const absl::Status& status) { return status.GetPayload(kLostPayload).has_value(); }

std::string SqlState(const absl::Status& status) { return PayloadOf(status, kStatePayload); }

std::string ViolatedConstraint(const absl::Status& status) {
  return PayloadOf(status, kConstraintPayload);
}

absl::StatusOr<std::unique_ptr<Session>> Session::Open(const Conninfo& conninfo,
                                                       std::chrono::milliseconds answer_timeout) {
  std::vector<const char*> keywords;
  std::vector<const char*> values;
  for (const auto& [keyword, value] : conninfo) {
    keywords.push_back(keyword.c_str());
    values.push_back(value.c_str());
  }
  keywords.push_back(nullptr);
  values.push_back(nullptr);
  std::unique_ptr<Session> session(
      new Session(PQconnectdbParams(keywords.data(), values.data(), 0), answer_timeout));
  PGconn* const connection = session->connection_.get();
  if (PQstatus(connection) != CONNECTION_OK) {
    return session->Lost(absl::StrCat("cannot connect: ", OneLine(PQerrorMessage(connection))));
  }
  if (PQsetnonblocking(connection, 1) != 0)
    return session->Lost("cannot switch the connection to non-blocking mode");
  PQsetNoticeReceiver(connection, &NoteWarning, session.get());
  return session;
}

Session::Session(PGconn* connection, std::chrono::milliseconds answer_timeout)
    : connection_(connection, PQfinish), answer_timeout_(answer_timeout) {}

void Session::NoteWarning(void* session, const PGresult* result) {
  if (FieldOf(result, PG_DIAG_SEVERITY_NONLOCALIZED) == "WARNING") {
    static_cast<Session*>(session)->warned_ = true;
  }
}

std::string Session::Describe() const {
  return absl::StrCat("database ", PQdb(connection_.get()), " at ", PQhost(connection_.get()));
}

absl::Status Session::Lost(const std::string& what) {
  lost_ = Unavailable(what);
  lost_.SetPayload(kLostPayload, absl::Cord("1"));
  return lost_;
}

// Waits until a result is available without blocking.
absl::Status Session::AwaitResult() {
  PGconn* const connection = connection_.get();
  while (true) {
    const int unsent = PQflush(connection);
    if (unsent < 0) return Lost(OneLine(PQerrorMessage(connection)));
    if (PQisBusy(connection) == 0) return absl::OkStatus();
    pollfd socket = {PQsocket(connection),
                     static_cast<short>(unsent > 0 ? POLLIN | POLLOUT : POLLIN), 0};
    const int ready = poll(&socket, 1, static_cast<int>(answer_timeout_.count()));
    if (ready < 0 && errno != EINTR) return Lost(std::strerror(errno));
    if (ready == 0) return Lost(absl::StrCat("no answer for ", answer_timeout_.count(), " ms"));
    if (ready > 0 && (socket.revents & ~POLLOUT) != 0 && PQconsumeInput(connection) == 0) {
      return Lost(OneLine(PQerrorMessage(connection)));
    }
  }
}

absl::StatusOr<PGresult*> Session::NextResult() {
  HULLD_RETURN_IF_ERROR(AwaitResult());
  return PQgetResult(connection_.get());
}

absl::Status Session::ErrorOf(const PGresult* result) {
  const std::string state = FieldOf(result, PG_DIAG_SQLSTATE);
  // Omits the details, which quote data.
  std::string message = FieldOf(result, PG_DIAG_MESSAGE_PRIMARY);
  if (message.empty()) message = OneLine(PQresultErrorMessage(result));
  const std::string severity = FieldOf(result, PG_DIAG_SEVERITY_NONLOCALIZED);
  if (PQstatus(connection_.get()) == CONNECTION_BAD || state.empty() || severity == "FATAL" ||
      severity == "PANIC") {
    return Lost(message);
  }
  absl::Status status = Unavailable(message);
  if (state == kDiskFull) {
    status = WithReason(absl::ResourceExhaustedError(message), v1::ERROR_REASON_DISK_FULL);
  }
  status.SetPayload(kStatePayload, absl::Cord(state));
  status.SetPayload(kConstraintPayload, absl::Cord(FieldOf(result, PG_DIAG_CONSTRAINT_NAME)));
  return status;
}

absl::StatusOr<Rows> Session::Run(const std::string& text) {
  if (!lost_.ok()) return lost_;
  if (PQsendQuery(connection_.get(), text.c_str()) == 0) {
    return Lost(OneLine(PQerrorMessage(connection_.get())));
  }
  Rows rows(nullptr);
  absl::Status failure;
  while (true) {
    HULLD_ASSIGN_OR_RETURN(PGresult* const result, NextResult());
    if (result == nullptr) break;
    rows = Rows(result);
    if (failure.ok() && IsError(result)) failure = ErrorOf(result);
  }
  if (!failure.ok()) return failure;
  return rows;
}

absl::Status Session::Send(const Statement& statement) {
  constexpr int kBinary = 1;
  std::vector<const char*> values;
  std::vector<int> lengths;
  for (const std::string& parameter : statement.parameters) {
    values.push_back(parameter.data());
    lengths.push_back(static_cast<int>(parameter.size()));
  }
  const std::vector<int> formats(values.size(), kBinary);
  const int count = static_cast<int>(values.size());
  const int sent = statement.name != nullptr
                       ? PQsendQueryPrepared(connection_.get(), statement.name, count,
                                             values.data(), lengths.data(), formats.data(), kBinary)
                       : PQsendQueryParams(connection_.get(), statement.text, count, nullptr,
                                           values.data(), lengths.data(), formats.data(), kBinary);
  if (sent == 0) return Lost(OneLine(PQerrorMessage(connection_.get())));
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Rows>> Session::Execute(std::span<const Statement> statements) {
  HULLD_RETURN_IF_ERROR(Start(statements));
  return Finish();
}

absl::Status Session::Start(std::span<const Statement> statements) {
  if (!lost_.ok()) return lost_;
  PGconn* const connection = connection_.get();
  if (PQenterPipelineMode(connection) == 0) return Lost("a statement is in progress");
  for (const Statement& statement : statements) {
    HULLD_RETURN_IF_ERROR(Send(statement));
  }
  // Sends as much as the connection accepts without blocking.
  if (PQpipelineSync(connection) == 0) return Lost(OneLine(PQerrorMessage(connection)));
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Rows>> Session::Finish() {
  if (!lost_.ok()) return lost_;
  PGconn* const connection = connection_.get();
  std::vector<Rows> rows;
  absl::Status failure;
  bool synced = false;
  while (!synced) {
    HULLD_ASSIGN_OR_RETURN(PGresult* const result, NextResult());
    if (result == nullptr) {
      // The end of a statement's results.
      if (PQstatus(connection) == CONNECTION_OK) continue;
      return Lost(OneLine(PQerrorMessage(connection)));
    }
    Rows one(result);
    synced = PQresultStatus(result) == PGRES_PIPELINE_SYNC;
    if (failure.ok() && IsError(result)) failure = ErrorOf(result);
    if (!lost_.ok()) return lost_;
    if (!synced) rows.push_back(std::move(one));
  }
  if (PQexitPipelineMode(connection) == 0) return Lost(OneLine(PQerrorMessage(connection)));
  if (!failure.ok()) return failure;
  return rows;
}

absl::Status Session::AwaitNotices(int wake, std::chrono::milliseconds longest) {
  if (!lost_.ok()) return lost_;
  PGconn* const connection = connection_.get();
  pollfd sources[] = {{PQsocket(connection), POLLIN, 0}, {wake, POLLIN, 0}};
  const int ready = poll(sources, 2, static_cast<int>(longest.count()));
  if (ready < 0 && errno != EINTR) return Lost(std::strerror(errno));
  if (ready > 0 && sources[0].revents != 0 && PQconsumeInput(connection) == 0) {
    return Lost(OneLine(PQerrorMessage(connection)));
  }
  return absl::OkStatus();
}

std::vector<std::string> Session::TakeNotices() {
  std::vector<std::string> payloads;
  while (true) {
    const std::unique_ptr<PGnotify, decltype(&PQfreemem)> notice(PQnotifies(connection_.get()),
                                                                 PQfreemem);
    if (notice == nullptr) return payloads;
    payloads.emplace_back(notice->extra);
  }
}

absl::StatusOr<Rows> Session::Execute(Statement statement) {
  HULLD_ASSIGN_OR_RETURN(std::vector<Rows> rows,
                         Execute(std::span<const Statement>(&statement, 1)));
  return std::move(rows.front());
}

absl::StatusOr<std::vector<Rows>> Session::ExecuteCommit(std::span<const Statement> statements) {
  warned_ = false;
  absl::StatusOr<std::vector<Rows>> rows = Execute(statements);
  if (rows.ok() && warned_) return Lost("PostgreSQL reported a warning during COMMIT");
  return rows;
}

absl::StatusOr<std::vector<Rows>> SessionPool::Execute(std::span<const Statement> statements) {
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<Session> session, Take(false));
  // Finish reports a lost session.
  session->Start(statements).IgnoreError();
  return Finish(std::move(session), statements);
}

std::unique_ptr<Session> SessionPool::TryStart(std::span<const Statement> statements) {
  std::unique_ptr<Session> session;
  {
    const std::lock_guard lock(mutex_);
    if (idle_.empty() || taken_ == max_sessions_) return nullptr;
    ++taken_;
    session = std::move(idle_.back());
    idle_.pop_back();
  }
  session->Start(statements).IgnoreError();
  return session;
}

absl::StatusOr<std::vector<Rows>> SessionPool::Finish(std::unique_ptr<Session> session,
                                                      std::span<const Statement> statements) {
  absl::StatusOr<std::vector<Rows>> rows = session->Finish();
  for (const bool again : {true, false}) {
    const bool is_lost = IsLost(rows.status());
    Return(is_lost ? nullptr : std::move(session));
    if (!is_lost || !again) break;
    HULLD_ASSIGN_OR_RETURN(session, Take(true));
    rows = session->Execute(statements);
  }
  return rows;
}

// fresh: drops idle sessions, which are as old as one that was lost.
absl::StatusOr<std::unique_ptr<Session>> SessionPool::Take(bool fresh) {
  std::vector<std::unique_ptr<Session>> old;
  {
    std::unique_lock lock(mutex_);
    free_.wait(lock, [this] { return taken_ < max_sessions_; });
    ++taken_;
    if (fresh) old.swap(idle_);
    if (!idle_.empty()) {
      std::unique_ptr<Session> session = std::move(idle_.back());
      idle_.pop_back();
      return session;
    }
  }
  absl::StatusOr<std::unique_ptr<Session>> session = open_();
  if (!session.ok()) Return(nullptr);
  return session;
}

// session: null if it is lost.
void SessionPool::Return(std::unique_ptr<Session> session) {
  {
    const std::lock_guard lock(mutex_);
    --taken_;
    if (session != nullptr) idle_.push_back(std::move(session));
  }
  free_.notify_one();
}

absl::StatusOr<uint64_t> SingleNumber(const absl::StatusOr<Rows>& rows) {
  if (!rows.ok()) return rows.status();
  uint64_t number = 0;
  if (rows->count() == 1 && absl::SimpleAtoi(std::string(rows->at(0, 0)), &number)) return number;
  return absl::DataLossError("the row of hulld.store is missing or damaged");
}

absl::StatusOr<bool> HasTable(Session& session, const std::string& name) {
  HULLD_ASSIGN_OR_RETURN(const Rows found,
                         session.Run(absl::StrCat("SELECT to_regclass('", name, "') IS NOT NULL")));
  return found.at(0, 0) == "t";
}

}  // namespace hulld::server
