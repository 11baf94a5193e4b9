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

// Sessions that threads take in turn. Thread-safe.
class SessionPool {
 public:
  using Opener = std::function<absl::StatusOr<std::unique_ptr<Session>>()>;

  // open: makes one. most: how many there are at a time; a thread that finds them all taken waits.
  SessionPool(Opener open, int most) : open_(std::move(open)), most_(most) {}

  // Session::Ask on one of them. If that was lost meanwhile, as after a restart of the database, it
  // asks once more on a new one.
  absl::StatusOr<std::vector<Rows>> Ask(std::span<const Statement> statements);

  // The two halves of Ask. TryStart waits for nothing: null where no session is idle. What is
  // started is to be finished or given up, on any thread, before anything else is asked where there
  // is one session.
  std::unique_ptr<Session> TryStart(std::span<const Statement> statements);
  // statements: the same.
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
