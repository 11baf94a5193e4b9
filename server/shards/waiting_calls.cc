#include "server/shards/waiting_calls.h"

#include <iterator>
#include <utility>

#include "core/base/check.h"
#include "server/contract/stopped_call.h"
#include "server/shards/shards.h"

namespace hulld::server {

WaitingCalls::Wait::Done WaitingCalls::Wait::Take() {
  const std::lock_guard lock(mutex_);
  if (done_ == nullptr) return nullptr;
  --calls_.count_;
  should_stop_ = nullptr;
  return std::exchange(done_, nullptr);
}

void WaitingCalls::Wait::Tell(const absl::Status& status) {
  if (const Done done = Take(); done != nullptr) done(status);
}

bool WaitingCalls::Wait::Withdraw() { return Take() != nullptr; }

// What should_stop looks at lives until the wait is over, so it is asked under the mutex.
bool WaitingCalls::Wait::EndIfStopped() {
  {
    const std::lock_guard lock(mutex_);
    if (done_ == nullptr) return false;
    if (!Stopped(should_stop_)) return true;
  }
  Tell(Cancelled());
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
  // Otherwise it looks by itself.
  if (was_empty) changed_.notify_one();
  return wait;
}

bool WaitingCalls::AwaitFresh(Shards& shards, std::span<const std::string> ids,
                              const ShardsFreshness& freshness, std::function<bool()> should_stop,
                              std::function<void(const absl::Status&)> done) {
  if (!shards.any_store().is_shared()) return false;
  const std::shared_ptr<Wait> wait = Add(std::move(should_stop), std::move(done));
  const bool asks =
      shards.StartFresh(ids, freshness, [wait](const absl::Status& status) { wait->Tell(status); });
  // Where it is over by now, it was cancelled, and told so.
  return asks || !wait->Withdraw();
}

void WaitingCalls::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !waits_.empty(); });
    changed_.wait_for(lock, kStopPoll, [this] { return ending_; });
    if (ending_) return;
    std::vector<std::shared_ptr<Wait>> looked_at = std::exchange(waits_, {});
    lock.unlock();
    std::erase_if(looked_at, [](const auto& wait) { return !wait->EndIfStopped(); });
    lock.lock();
    std::move(looked_at.begin(), looked_at.end(), std::back_inserter(waits_));
  }
}

}  // namespace hulld::server
