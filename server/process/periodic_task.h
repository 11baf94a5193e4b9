#ifndef HULLD_SERVER_PROCESS_PERIODIC_TASK_H_
#define HULLD_SERVER_PROCESS_PERIODIC_TASK_H_

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

namespace hulld::server {

// Runs a task at intervals on its own thread. The destructor waits for a running task to end.
class PeriodicTask {
 public:
  PeriodicTask(std::chrono::milliseconds interval, std::function<void()> task)
      : thread_([interval, task = std::move(task)](const std::stop_token& stop) {
          std::mutex mutex;
          std::condition_variable_any stopped;
          std::unique_lock lock(mutex);
          const auto is_stopped = [&stop] { return stop.stop_requested(); };
          while (!stopped.wait_for(lock, stop, interval, is_stopped)) task();
        }) {}

 private:
  std::jthread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_PERIODIC_TASK_H_
