#include "server/store/postgres/batch_notices.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace hulld::server {
namespace {

using Clock = std::chrono::steady_clock;

// A database contains one store, so the channel's name need not identify it.
constexpr char kListen[] = "LISTEN hulld_batches";
constexpr char kNotify[] = "NOTIFY hulld_batches";
constexpr std::chrono::milliseconds kForever{-1};
// Retry delay after the database refused to listen.
constexpr std::chrono::minutes kRefusedRetry{1};

// Time until `end`, at least 0.
std::chrono::milliseconds UpTo(Clock::time_point end) {
  return std::max(std::chrono::milliseconds(0),
                  std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()));
}

}  // namespace

absl::StatusOr<uint64_t> LastBatch(Session& session) {
  return SingleNumber(session.Run("SELECT batch FROM hulld.store"));
}

BatchNotices::BatchNotices(Opener open, std::chrono::milliseconds retry,
                           std::function<void(uint64_t batch)> on_batch, std::string fallback)
    : open_(std::move(open)),
      retry_(retry),
      on_batch_(std::move(on_batch)),
      fallback_(std::move(fallback)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  HULLD_CHECK(wake_ >= 0);
  thread_ = std::thread([this] { Run(); });
}

BatchNotices::~BatchNotices() {
  ending_ = true;
  eventfd_write(wake_, 1);
  thread_.join();
  close(wake_);
}

void BatchNotices::Send(uint64_t batch) {
  to_send_ = batch;
  eventfd_write(wake_, 1);
}

void BatchNotices::Run() {
  bool failing = false;
  while (!ending_) {
    const absl::Status status = Serve();
    const bool was_listening = is_listening_.exchange(false);
    if (ending_) return;
    const bool is_refused = !was_listening && !SqlState(status).empty();
    const bool was_failing = std::exchange(failing, true);
    if (was_listening || !was_failing) {
      spdlog::warn("{} ({}); until that changes, {}",
                   is_refused ? "the database refused to report commits of peer servers"
                              : "lost the session that receives commit notices of peer servers",
                   std::string(status.message()), fallback_);
    }
    AwaitRetry(is_refused ? kRefusedRetry : retry_);
  }
}

// Listens and sends until the session is lost or the thread must end.
absl::Status BatchNotices::Serve() {
  HULLD_ASSIGN_OR_RETURN(const std::unique_ptr<Session> opened, open_());
  Session& session = *opened;
  HULLD_RETURN_IF_ERROR(session.Run(kListen).status());
  // From here on, each later batch arrives as a notice.
  HULLD_ASSIGN_OR_RETURN(const uint64_t last, LastBatch(session));
  is_listening_ = true;
  NoteReceived(last);
  Clock::time_point next = Clock::now();
  while (true) {
    // Cleared before the conditions are checked, so later events wake the thread again.
    ClearWake();
    if (ending_) return absl::OkStatus();
    const uint64_t batch = to_send_;
    if (batch != sent_ && Clock::now() >= next) {
      HULLD_RETURN_IF_ERROR(session.Run(absl::StrCat(kNotify, ", '", batch, "'")).status());
      sent_ = batch;
      next = Clock::now() + kMinPause;
    }
    // Notices also arrive with the answers to queries.
    for (const std::string& payload : session.TakeNotices()) {
      uint64_t received = 0;
      if (absl::SimpleAtoi(payload, &received)) NoteReceived(received);
    }
    const auto longest = to_send_ == sent_ ? kForever : UpTo(next);
    HULLD_RETURN_IF_ERROR(session.AwaitNotices(wake_, longest));
  }
}

void BatchNotices::NoteReceived(uint64_t batch) {
  // Notices from two servers may arrive in a different order than their commits.
  last_received_ = std::max(last_received_.load(), batch);
  on_batch_(batch);
}

void BatchNotices::ClearWake() const {
  eventfd_t count = 0;
  eventfd_read(wake_, &count);
}

// Batches committed during the pause are sent after a session exists.
void BatchNotices::AwaitRetry(std::chrono::milliseconds pause) const {
  const Clock::time_point end = Clock::now() + pause;
  while (!ending_ && Clock::now() < end) {
    pollfd wake = {wake_, POLLIN, 0};
    poll(&wake, 1, static_cast<int>(UpTo(end).count()));
    ClearWake();
  }
}

}  // namespace hulld::server
