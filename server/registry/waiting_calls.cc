#include "server/registry/waiting_calls.h"

#include <iterator>
#include <utility>

#include "core/base/check.h"
#include "server/contract/stopped_call.h"

namespace hulld::server {

void WaitingCalls::Wait::Finish(const absl::Status& status) {
  Done done;
  {
    const std::lock_guard lock(mutex_);
    if (done_ == nullptr) return;
    --calls_.count_;
    should_stop_ = nullptr;
    done = std::exchange(done_, nullptr);
  }
  done(status);
}

// The state that should_stop reads lives until the wait is over, so it is called under the mutex.
bool WaitingCalls::Wait::EndIfStopped() {
  {
    const std::lock_guard lock(mutex_);
    if (done_ == nullptr) return false;
    if (!Stopped(should_stop_)) return true;
  }
  Finish(Cancelled());
  return false;
}

WaitingCalls::~WaitingCalls() {
  HULLD_CHECK(count() == 0);
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::shared_ptr<WaitingCalls::Wait> WaitingCalls::Add(
    std::function<bool()> should_stop, std::function<void(const absl::Status&)> done) {
  const std::shared_ptr<Wait> wait(new Wait(*this, std::move(should_stop), std::move(done)));
  ++count_;
  bool was_empty = false;
  {
    const std::lock_guard lock(mutex_);
    was_empty = waits_.empty();
    waits_.push_back(wait);
  }
  // The thread polls without a notification if other waits exist.
  if (was_empty) changed_.notify_one();
  return wait;
}

bool WaitingCalls::AwaitFresh(Registry& registry, const Freshness& freshness,
                              std::function<bool()> should_stop,
                              std::function<void(const absl::Status&)> done) {
  PeerSync& peers = registry.peers();
  if (!registry.has_peers() || peers.TryFresh(freshness).has_value()) return false;
  const std::shared_ptr<Wait> wait = Add(std::move(should_stop), std::move(done));
  peers.StartFetch([wait](const absl::Status& status) { wait->Finish(status); });
  return true;
}

void WaitingCalls::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !waits_.empty(); });
    changed_.wait_for(lock, kStopPoll, [this] { return ending_; });
    if (ending_) return;
    std::vector<std::shared_ptr<Wait>> polled = std::exchange(waits_, {});
    lock.unlock();
    std::erase_if(polled, [](const auto& wait) { return !wait->EndIfStopped(); });
    lock.lock();
    std::move(polled.begin(), polled.end(), std::back_inserter(waits_));
  }
}

}  // namespace hulld::server
