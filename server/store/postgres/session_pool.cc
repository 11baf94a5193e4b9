#include "server/store/postgres/session_pool.h"

#include <absl/status/status.h>

#include <utility>

#include "core/base/status_macros.h"

namespace hulld::server {

absl::StatusOr<std::vector<Rows>> SessionPool::Ask(std::span<const Statement> statements) {
  HULLD_ASSIGN_OR_RETURN(std::unique_ptr<Session> session, Take(false));
  // Finish reports a lost session.
  session->Start(statements).IgnoreError();
  return Finish(std::move(session), statements);
}

std::unique_ptr<Session> SessionPool::TryStart(std::span<const Statement> statements) {
  std::unique_ptr<Session> session;
  {
    const std::lock_guard lock(mutex_);
    if (idle_.empty() || taken_ == most_) return nullptr;
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
    GiveBack(is_lost ? nullptr : std::move(session));
    if (!is_lost || !again) break;
    HULLD_ASSIGN_OR_RETURN(session, Take(true));
    rows = session->Ask(statements);
  }
  return rows;
}

// fresh: drops idle sessions, which are as old as one that was lost.
absl::StatusOr<std::unique_ptr<Session>> SessionPool::Take(bool fresh) {
  std::vector<std::unique_ptr<Session>> old;
  {
    std::unique_lock lock(mutex_);
    free_.wait(lock, [this] { return taken_ < most_; });
    ++taken_;
    if (fresh) old.swap(idle_);
    if (!idle_.empty()) {
      std::unique_ptr<Session> session = std::move(idle_.back());
      idle_.pop_back();
      return session;
    }
  }
  absl::StatusOr<std::unique_ptr<Session>> session = open_();
  if (!session.ok()) GiveBack(nullptr);
  return session;
}

// session: null if it is lost.
void SessionPool::GiveBack(std::unique_ptr<Session> session) {
  {
    const std::lock_guard lock(mutex_);
    --taken_;
    if (session != nullptr) idle_.push_back(std::move(session));
  }
  free_.notify_one();
}

}  // namespace hulld::server
