// Which server is active, and how that ends.
#include <absl/status/status.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "server/store/postgres/postgres_store.h"
#include "server/store/store_errors.h"

namespace hulld::server {
namespace {

// Names the advisory lock of the active server within its database: "hulld" as a number.
constexpr uint64_t kLock = 0x68756c6c64;
constexpr int kBeatsPerMeasure = 10;

}  // namespace

// Whether there are tables of ours. FAILED_PRECONDITION: they are those of a newer hulld.
absl::StatusOr<bool> PostgresStore::CheckFormat(Session& session) const {
  const absl::StatusOr<Rows> exists = session.Run("SELECT to_regclass('hulld.store') IS NOT NULL");
  if (!exists.ok()) return exists.status();
  if (exists->at(0, 0) != "t") return false;
  const absl::StatusOr<Rows> format = RunPatiently(session, "SELECT format FROM hulld.store");
  if (!format.ok()) return format.status();
  uint64_t number = 0;
  if (format->count() != 1 || !absl::SimpleAtoi(std::string(format->at(0, 0)), &number)) {
    return absl::DataLossError("the row of hulld.store is missing");
  }
  if (number <= kFormat) {
    const absl::StatusOr<Rows> mark =
        session.Run("SELECT to_regclass('hulld.migration') IS NOT NULL");
    if (!mark.ok()) return mark.status();
    if (options_.migrating || mark->at(0, 0) != "t") return true;
    return UnfinishedMigration();
  }
  return absl::FailedPreconditionError(absl::StrCat("it was written in format ", number,
                                                    "; this hulld knows format ", kFormat,
                                                    " at most; run the hulld that wrote it"));
}

// Whether the database holds the slots that this is to serve, or is to take them, as one that holds
// nothing yet, and all slots so far, does. Changes nothing.
absl::StatusOr<bool> PostgresStore::CheckSlots(Session& session) {
  const absl::StatusOr<Rows> column = session.Run(
      "SELECT 1 FROM pg_attribute WHERE attrelid = 'hulld.store'::regclass AND attname = 'slots'");
  if (!column.ok()) return column.status();
  std::string held;
  if (column->count() > 0) {
    const absl::StatusOr<Rows> slots = session.Run("SELECT coalesce(slots, '') FROM hulld.store");
    if (!slots.ok()) return slots.status();
    if (slots->count() != 1) return absl::DataLossError("the row of hulld.store is missing");
    held = std::string(slots->at(0, 0));
  }
  if (held == options_.slots) return true;
  if (held.empty()) {
    if (absl::Status s = CheckIsEmpty(session); !s.ok()) return s;
    return false;
  }
  if (options_.slots.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("this database is one of several shards, and holds slots ", held,
                     ": start hulld with the file that names them all (--postgres-shards)"));
  }
  return absl::FailedPreconditionError(
      absl::StrCat("this database holds slots ", held,
                   ", and the file of --postgres-shards gives it ", options_.slots,
                   ": start hulld with the file that it was filled with; to move slots, end all "
                   "servers and copy "
                   "the hulls to other databases (hulld migrate)"));
}

absl::Status PostgresStore::CheckIsEmpty(Session& session) {
  const absl::StatusOr<Rows> held = session.Run(
      "SELECT revision > 0 OR EXISTS (SELECT 1 FROM hulld.hulls) OR EXISTS "
      "(SELECT 1 FROM hulld.bodies) FROM hulld.store");
  if (!held.ok()) return held.status();
  if (held->count() != 1) return absl::DataLossError("the row of hulld.store is missing");
  if (held->at(0, 0) == "f") return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      "this database holds hulls of all slots, and the file of --postgres-shards gives it ",
      options_.slots,
      ": end all servers and copy them to other databases, which that file names (hulld "
      "migrate)"));
}

// Servers that are active over it with all slots, which know nothing of this, are shut out.
absl::Status PostgresStore::TakeSlots(Session& session) {
  absl::Status status = session.Run("BEGIN; SELECT 1 FROM hulld.store FOR UPDATE").status();
  if (status.ok()) status = CheckIsEmpty(session);
  if (status.ok()) {
    status = session
                 .Run(absl::StrCat("ALTER TABLE hulld.store ADD COLUMN IF NOT EXISTS slots text; "
                                   "UPDATE hulld.store SET slots = '",
                                   options_.slots, "', format = ", kFormat,
                                   ", owner = '', epoch = epoch + 1, written_in = epoch + 1; "
                                   "INSERT INTO hulld.epochs (epoch, owner, batch, revision) "
                                   "SELECT epoch, owner, batch, revision FROM hulld.store; COMMIT"))
                 .status();
  }
  if (!status.ok()) session.Run("ROLLBACK").status().IgnoreError();
  return status;
}

absl::StatusOr<bool> PostgresStore::TryLock(Session& session) const {
  const absl::StatusOr<Rows> locked = session.Run(absl::StrCat(
      "SELECT pg_try_advisory_lock", options_.shared ? "_shared" : "", "(", kLock, ")"));
  if (!locked.ok()) return locked.status();
  return locked->at(0, 0) == "t";
}

absl::StatusOr<std::string> PostgresStore::Owner(Session& session) const {
  const absl::StatusOr<Rows> owner = session.Run("SELECT owner FROM hulld.store");
  if (!owner.ok()) return owner.status();
  return owner->count() == 0 ? "" : std::string(owner->at(0, 0));
}

absl::Status PostgresStore::Superseded(std::string_view owner) {
  return absl::UnavailableError(absl::StrCat(
      "another hulld took over the store", owner.empty() ? "" : " (", std::string(owner),
      owner.empty() ? "" : ")", ": this one ends and changes nothing; call that one"));
}

void PostgresStore::Keep() {
  bool failing = false;
  int deaf_beats = 0;
  bool said_deaf = false;
  std::unique_lock lock(mutex_);
  const auto period = options_.shared ? std::min(options_.look, options_.beat) : options_.beat;
  const int64_t looks_per_beat = options_.beat / period;
  for (int64_t look = 1; !wake_.wait_for(lock, period, [this] { return ending_; }); ++look) {
    const bool is_beat = look % looks_per_beat == 0;
    // A database that is gone is not asked more often than that.
    if (keeper_session_ == nullptr && !is_beat) continue;
    lock.unlock();
    if (is_beat) {
      const bool is_deaf = notices_ != nullptr && notices_->is_listening() && !HearsOthers();
      deaf_beats = is_deaf ? deaf_beats + 1 : 0;
      said_deaf = said_deaf && is_deaf;
    }
    // Twice in a row is no accident.
    if (deaf_beats == 2 && !std::exchange(said_deaf, true)) {
      spdlog::warn(
          "no notice comes of what other servers commit, although the session that listens is "
          "there; until one does, it is asked for that every {} ms",
          options_.look.count());
    }
    absl::Status status;
    if (is_beat) status = Beat();
    if (status.ok() && is_beat && options_.shared) status = EndStuckTurns();
    if (status.ok() && options_.shared && (is_beat || !HearsOthers())) status = LookForOthers();
    if (status.ok() && look % (looks_per_beat * kBeatsPerMeasure) == 0) status = MeasureDisk();
    if (!status.ok()) {
      keeper_session_ = nullptr;
      has_lock_ = false;
    }
    if (!status.ok() && !failing) {
      spdlog::error("cannot ask the database whether this is the active server: {}",
                    std::string(status.message()));
    }
    if (status.ok() && failing) spdlog::warn("the database answers again");
    failing = !status.ok();
    lock.lock();
    if (!ended_.ok()) return;
  }
}

absl::Status PostgresStore::Beat() {
  if (keeper_session_ == nullptr) {
    absl::StatusOr<std::unique_ptr<Session>> session = OpenKeeper();
    if (!session.ok()) return session.status();
    keeper_session_ = *std::move(session);
  }
  const absl::StatusOr<std::string> owner = Owner(*keeper_session_);
  if (!owner.ok()) return owner.status();
  if (*owner != store_owner()) {
    End(Superseded(*owner));
    return absl::OkStatus();
  }
  if (has_lock_) return absl::OkStatus();
  const absl::StatusOr<bool> locked = TryLock(*keeper_session_);
  if (!locked.ok()) return locked.status();
  has_lock_ = *locked;
  return absl::OkStatus();
}

// What the tables take, as far as the role may ask.
absl::Status PostgresStore::MeasureDisk() {
  const absl::StatusOr<Rows> size = keeper_session_->Run(
      "SELECT sum(pg_total_relation_size(oid)) FROM pg_class "
      "WHERE relnamespace = 'hulld'::regnamespace AND relkind = 'r'");
  if (!size.ok()) return size.status();
  StoreDisk disk;
  if (size->count() != 1 || !absl::SimpleAtoi(std::string(size->at(0, 0)), &disk.bytes)) {
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

// This is not the active server any more, and never will be again.
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
