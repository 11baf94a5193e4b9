#include "client/hullctl/load/load.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

namespace hulld {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPauseAfterFailure(10);
constexpr std::chrono::milliseconds kLook(100);

// State shared by all clients of a run.
class LoadRun {
 public:
  LoadRun(const LoadPlan& plan, const std::atomic<bool>& stop)
      : plan_(plan), stop_(stop), start_(Clock::now()) {}

  // Sends requests until the plan is complete.
  LoadResult RunClient(const LoadRequest& request) {
    LoadResult result;
    for (;;) {
      const uint64_t i = next_.fetch_add(1);
      if (plan_.requests && i >= *plan_.requests) break;
      const Clock::time_point due = WaitForTurn(i);
      if (stop_ || IsOver()) break;
      started_.fetch_add(1, std::memory_order_relaxed);
      const absl::StatusOr<uint64_t> items = request(i);
      done_.fetch_add(1, std::memory_order_relaxed);
      if (items.ok()) {
        result.latencies.Record(Clock::now() - due);
        result.items += *items;
        continue;
      }
      LoadFailures& failures = result.failures[items.status().code()];
      if (failures.count++ == 0) failures.message = std::string(items.status().message());
      std::this_thread::sleep_for(kPauseAfterFailure);
    }
    return result;
  }

  uint64_t done() const { return done_.load(std::memory_order_relaxed); }
  Clock::duration elapsed() const { return Clock::now() - start_; }
  // Returns the number of requests that were due by now, or by the end of the run, and not started.
  uint64_t Missed() const {
    if (!plan_.rate) return 0;
    std::chrono::duration<double> seconds = elapsed();
    if (plan_.duration) seconds = std::min<std::chrono::duration<double>>(seconds, *plan_.duration);
    auto due = static_cast<uint64_t>(*plan_.rate * seconds.count());
    if (plan_.requests) due = std::min(due, *plan_.requests);
    return due - std::min(due, started_.load());
  }
  double Share() const {
    double share = 0;
    if (plan_.requests) share = static_cast<double>(done()) / static_cast<double>(*plan_.requests);
    if (plan_.duration) {
      share = std::max(share, std::chrono::duration<double>(elapsed()) / *plan_.duration);
    }
    return std::min(share, 1.0);
  }

 private:
  bool IsOver() const { return plan_.duration && elapsed() >= *plan_.duration; }

  // Waits until request i is due and returns that time; checks for a stop while waiting.
  Clock::time_point WaitForTurn(uint64_t i) const {
    if (!plan_.rate) return Clock::now();
    const std::chrono::duration<double> offset(static_cast<double>(i) / *plan_.rate);
    const Clock::time_point due = start_ + std::chrono::duration_cast<Clock::duration>(offset);
    while (!stop_ && !IsOver() && Clock::now() < due) {
      std::this_thread::sleep_until(std::min(due, Clock::now() + kLook));
    }
    return due;
  }

  const LoadPlan& plan_;
  const std::atomic<bool>& stop_;
  const Clock::time_point start_;
  std::atomic<uint64_t> next_ = 0;
  std::atomic<uint64_t> started_ = 0;
  std::atomic<uint64_t> done_ = 0;
};

void Merge(LoadResult&& part, LoadResult* sum) {
  sum->latencies.Merge(part.latencies);
  sum->items += part.items;
  for (auto& [code, failures] : part.failures) {
    LoadFailures& all = sum->failures[code];
    if (all.count == 0) all.message = std::move(failures.message);
    all.count += failures.count;
  }
}

}  // namespace

uint64_t LoadResult::failed() const {
  uint64_t sum = 0;
  for (const auto& [code, each] : failures) sum += each.count;
  return sum;
}

LoadResult RunLoad(const LoadPlan& plan, const std::vector<LoadRequest>& clients,
                   const std::atomic<bool>& stop,
                   const std::function<void(double share, uint64_t requests)>& progress) {
  LoadRun run(plan, stop);
  LoadResult sum;
  std::mutex mutex;
  std::condition_variable ended;
  size_t running = clients.size();
  std::vector<std::thread> threads;
  for (const LoadRequest& client : clients) {
    threads.emplace_back([&] {
      LoadResult part = run.RunClient(client);
      const std::lock_guard lock(mutex);
      Merge(std::move(part), &sum);
      --running;
      ended.notify_all();
    });
  }
  {
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, kLook, [&] { return running == 0; })) {
      progress(run.Share(), run.done());
    }
  }
  for (std::thread& thread : threads) thread.join();
  sum.elapsed = run.elapsed();
  sum.missed = run.Missed();
  return sum;
}

}  // namespace hulld
