#ifndef HULLD_CLIENT_HULLCTL_VIEW_ORDERED_WORKER_H_
#define HULLD_CLIENT_HULLCTL_VIEW_ORDERED_WORKER_H_

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace hulld {

// Processes work items one by one, in order of submission, on its own thread. Thread-safe.
template <typename Work>
class OrderedWorker {
 public:
  // `most`: maximum number of pending items. Calls `work` for each until it returns false.
  OrderedWorker(size_t most, std::function<bool(const Work&)> work)
      : most_(most), work_(std::move(work)), thread_([this] { Run(); }) {}
  // Waits for the item in flight; drops pending ones.
  ~OrderedWorker() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  OrderedWorker(const OrderedWorker&) = delete;
  OrderedWorker& operator=(const OrderedWorker&) = delete;

  // Returns true if the item was accepted: the queue had room.
  [[nodiscard]] bool Ask(Work work) {
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.size() >= most_) return false;
      waiting_.push_back(std::move(work));
    }
    changed_.notify_all();
    return true;
  }
  // Drops pending items.
  void Forget() {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
  }

 private:
  void Run() {
    while (true) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return !waiting_.empty() || ended_; });
      if (ended_) return;
      const Work work = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      if (!work_(work)) return;
    }
  }

  const size_t most_;
  const std::function<bool(const Work&)> work_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by the mutex.
  std::deque<Work> waiting_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_ORDERED_WORKER_H_
