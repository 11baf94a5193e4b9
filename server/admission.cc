#include "server/admission.h"

#include <absl/status/status.h>

namespace hulld::server {

absl::StatusOr<Admission::Ticket> Admission::Admit() {
  const std::lock_guard lock(mutex_);
  if (draining_) {
    return absl::UnavailableError("hulld is draining and ends soon; retry when it is back");
  }
  ++running_;
  return Ticket(this, [](Admission* admission) { admission->Leave(); });
}

void Admission::BeginDrain() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
}

bool Admission::WaitIdle(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return idle_.wait_until(lock, deadline, [this] { return running_ == 0; });
}

void Admission::Leave() {
  // Notified under the lock: whoever waits may destroy this as soon as it is released.
  const std::lock_guard lock(mutex_);
  if (--running_ == 0) idle_.notify_all();
}

}  // namespace hulld::server
