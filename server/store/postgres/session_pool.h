#ifndef HULLD_SERVER_STORE_POSTGRES_SESSION_POOL_H_
#define HULLD_SERVER_STORE_POSTGRES_SESSION_POOL_H_

#include <absl/status/statusor.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "server/store/postgres/session.h"

namespace hulld::server {

// Sessions shared by threads; each is used by one thread at a time. Thread-safe.
class SessionPool {
 public:
  using Opener = std::function<absl::StatusOr<std::unique_ptr<Session>>()>;

  // open: creates a session. most: maximum number of sessions; a thread waits if all are in use.
  SessionPool(Opener open, int most) : open_(std::move(open)), most_(most) {}

  // Session::Ask on one of the sessions. If it was lost since its last use, for example by a
  // restart of the database, retries once on a new one.
  absl::StatusOr<std::vector<Rows>> Ask(std::span<const Statement> statements);

  // The two halves of Ask. TryStart does not block: returns null if no session is idle. A started
  // query must be finished or dropped, on any thread, before the next one if there is only one
  // session.
  std::unique_ptr<Session> TryStart(std::span<const Statement> statements);
  // statements: as passed to TryStart.
  absl::StatusOr<std::vector<Rows>> Finish(std::unique_ptr<Session> session,
                                           std::span<const Statement> statements);
  void GiveUp(std::unique_ptr<Session> session) {
    if (session != nullptr) GiveBack(nullptr);
  }

 private:
  absl::StatusOr<std::unique_ptr<Session>> Take(bool fresh);
  void GiveBack(std::unique_ptr<Session> session);

  const Opener open_;
  const int most_;
  std::mutex mutex_;
  std::condition_variable free_;
  // Guarded by mutex_.
  std::vector<std::unique_ptr<Session>> idle_;
  int taken_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_SESSION_POOL_H_
