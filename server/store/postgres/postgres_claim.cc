// Claiming the store as the active server, and losing the claim.
#include <absl/status/status.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/store_errors.h"

namespace hulld::server {
namespace {

// Key of the active server's advisory lock within its database: "hulld" as a number.
constexpr uint64_t kLock = 0x68756c6c64;
constexpr int kHeartbeatsPerMeasure = 10;

}  // namespace

// Returns true if the tables exist. FAILED_PRECONDITION: they are in another format.
absl::StatusOr<bool> PostgresStore::CheckFormat(Session& session) const {
  const absl::StatusOr<bool> exists = HasTable(session, "hulld.store");
  if (!exists.ok() || !*exists) return exists;
  HULLD_ASSIGN_OR_RETURN(const uint64_t number,
                         SingleNumber(session.Run("SELECT format FROM hulld.store")));
  if (number != kFormat) return OtherFormat("the store", number, kFormat);
  const absl::StatusOr<bool> is_marked = HasTable(session, "hulld.migration");
  if (!is_marked.ok()) return is_marked;
  if (options_.migrating || !*is_marked) return true;
  return UnfinishedMigration();
}

absl::StatusOr<bool> PostgresStore::TryLock(Session& session) const {
  const char* const lock = options_.shared ? "pg_try_advisory_lock_shared" : "pg_try_advisory_lock";
  HULLD_ASSIGN_OR_RETURN(const Rows locked,
                         session.Run(absl::StrCat("SELECT ", lock, "(", kLock, ")")));
  return locked.at(0, 0) == "t";
}

absl::StatusOr<std::string> PostgresStore::Owner(Session& session) const {
  HULLD_ASSIGN_OR_RETURN(const Rows owner, session.Run("SELECT owner FROM hulld.store"));
  return owner.count() == 0 ? "" : std::string(owner.at(0, 0));
}

absl::Status PostgresStore::Superseded(std::string_view owner) {
  return absl::UnavailableError(
      absl::StrCat("another hulld took over the store", owner.empty() ? "" : " (",
                   std::string(owner), owner.empty() ? "" : ")",
                   ": this server exits without changing anything; connect to the other one"));
}

void PostgresStore::RunKeeper() {
  bool failing = false;
  int silent_heartbeats = 0;
  bool reported_silence = false;
  std::unique_lock lock(mutex_);
  const auto period =
      options_.shared ? std::min(options_.poll_interval, options_.heartbeat) : options_.heartbeat;
  const int64_t polls_per_heartbeat = options_.heartbeat / period;
  for (int64_t poll = 1; !wake_.wait_for(lock, period, [this] { return ending_; }); ++poll) {
    const bool is_heartbeat = poll % polls_per_heartbeat == 0;
    // Retries an unreachable database only once per heartbeat.
    if (keeper_session_ == nullptr && !is_heartbeat) continue;
    lock.unlock();
    if (is_heartbeat) {
      const bool is_silent = notices_ != nullptr && notices_->is_listening() && !ReceivesNotices();
      silent_heartbeats = is_silent ? silent_heartbeats + 1 : 0;
      reported_silence = reported_silence && is_silent;
    }
    // Two heartbeats without the expected notice are not a coincidence.
    if (silent_heartbeats == 2 && !std::exchange(reported_silence, true)) {
      spdlog::warn(
          "no commit notices are arriving although the listening session is open; polling the "
          "database every {} ms until one arrives",
          options_.poll_interval.count());
    }
    absl::Status status;
    if (is_heartbeat) status = CheckActive();
    if (status.ok() && is_heartbeat && options_.shared) status = EndStuckTransactions();
    if (status.ok() && options_.shared && (is_heartbeat || !ReceivesNotices())) {
      status = PollPeers();
    }
    if (status.ok() && poll % (polls_per_heartbeat * kHeartbeatsPerMeasure) == 0)
      status = MeasureDisk();
    if (!status.ok()) {
      keeper_session_ = nullptr;
      has_lock_ = false;
    }
    if (!status.ok() && !failing) {
      spdlog::error("cannot verify with the database that this server is active: {}",
                    std::string(status.message()));
    }
    if (status.ok() && failing) spdlog::warn("the database responds again");
    failing = !status.ok();
    lock.lock();
    if (!ended_.ok()) return;
  }
}

absl::Status PostgresStore::CheckActive() {
  if (keeper_session_ == nullptr) {
    HULLD_ASSIGN_OR_RETURN(keeper_session_, OpenKeeper());
  }
  HULLD_ASSIGN_OR_RETURN(const std::string owner, Owner(*keeper_session_));
  if (owner != store_owner()) {
    End(Superseded(owner));
    return absl::OkStatus();
  }
  if (has_lock_) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(has_lock_, TryLock(*keeper_session_));
  return absl::OkStatus();
}

// Measures the size of the tables, if the role permits it.
absl::Status PostgresStore::MeasureDisk() {
  HULLD_ASSIGN_OR_RETURN(
      const Rows size,
      keeper_session_->Run("SELECT sum(pg_total_relation_size(oid)) FROM pg_class "
                           "WHERE relnamespace = 'hulld'::regnamespace AND relkind = 'r'"));
  StoreDisk disk;
  if (size.count() != 1 || !absl::SimpleAtoi(std::string(size.at(0, 0)), &disk.bytes)) {
    return absl::OkStatus();
  }
  const std::lock_guard lock(mutex_);
  disk_ = disk;
  return absl::OkStatus();
}

std::optional<StoreDisk> PostgresStore::disk() const {
  const std::lock_guard lock(mutex_);
  return disk_;
}

// Ends this store permanently: it is no longer the active server.
void PostgresStore::End(const absl::Status& reason) {
  std::function<void()> on_ended;
  {
    const std::lock_guard lock(mutex_);
    if (!ended_.ok()) return;
    ended_ = reason;
    on_ended = on_ended_;
  }
  spdlog::critical("{}", std::string(reason.message()));
  if (on_ended) on_ended();
}

absl::Status PostgresStore::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

void PostgresStore::OnEnded(std::function<void()> ended) {
  {
    const std::lock_guard lock(mutex_);
    on_ended_ = ended;
    if (ended_.ok()) return;
  }
  ended();
}

}  // namespace hulld::server
