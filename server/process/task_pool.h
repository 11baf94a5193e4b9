#ifndef HULLD_SERVER_PROCESS_TASK_POOL_H_
#define HULLD_SERVER_PROCESS_TASK_POOL_H_

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "server/process/fair_queue.h"
#include "server/process/metrics.h"

namespace hulld::server {

// The threads that compute answers, at the priority of the process. They take tasks from two
// queues. Single calls come first: clients take turns, and the calls of one client come in the
// order in which they arrived. Slices of long calls come next: each long call has a lane, clients
// take turns, and the lanes of one client too, one slice each. A slice lasts about kSliceTime, so a
// single call waits for at most one slice, and no thread waits for another.
//
// Tasks must neither block nor wait; work that does belongs to a WorkerPool.
class TaskPool {
 private:
  struct Task {
    std::function<void()> run;
    std::chrono::steady_clock::time_point submitted;
    bool is_slice;
  };

 public:
  // How long a slice may take. A choice: an answer of a single call takes about as long over the
  // wire, and a switch of tasks (observed: 2 us) costs a hundredth.
  static constexpr std::chrono::microseconds kSliceTime{250};
  // While single calls arrive, and this long after, slices leave one thread's core to them: the
  // system lets a thread that computes go on for some milliseconds (a tick of Linux is 1 to 10 ms)
  // before gRPC's threads, which bring the calls, get their turn.
  static constexpr std::chrono::milliseconds kReserveTime{20};
  // Meanwhile a thread pauses this long after each slice: the system gives its core to the threads
  // of gRPC, and of clients on this machine, that wait for one, and would otherwise let this thread
  // go on until the next tick. Observed on two cores: single calls beside batches have a p99 of 2.2
  // to 3.0 times idle, without pauses 7 to 9 times; batches make a third to a half fewer pairs
  // meanwhile (tests/bench/results/server_overload_*.csv).
  static constexpr std::chrono::microseconds kPauseTime{80};

  // The slices of one long call. Destroyed with none of them waiting: let each hold its owner.
  class Lane {
   public:
    // The pool must outlive this.
    explicit Lane(TaskPool& pool) : pool_(pool) {}
    Lane(const Lane&) = delete;
    Lane& operator=(const Lane&) = delete;
    ~Lane();

    // Slices of a lane start in the order in which they were submitted, on any thread; several may
    // run at the same time. client: the one that waits for it, the same for all of a lane.
    void Submit(std::function<void()> slice, ClientId client = kNoClient);

   private:
    friend class TaskPool;

    TaskPool& pool_;
    // The rest is guarded by the pool's mutex.
    ClientId client_ = kNoClient;
    // The lane takes part in the turns while there are any.
    std::deque<Task> slices_;
  };

  // metrics: where to report what waits, single calls and slices apart. Requires threads > 0.
  explicit TaskPool(int threads, std::optional<PoolMetrics> single_metrics = std::nullopt,
                    std::optional<PoolMetrics> slice_metrics = std::nullopt);
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;
  // Runs what is queued, then ends.
  ~TaskPool();

  int threads() const { return static_cast<int>(threads_.size()); }

  // Queues the answer of a single call ahead of all slices. client: the one that waits for it.
  void Submit(std::function<void()> task, ClientId client = kNoClient);

  // Says that a single call was answered without this pool, so that slices leave it a core.
  // Cost: ~30 ns.
  void NoteSingleCall();

  // Single calls that wait for a thread.
  size_t waiting() const { return waiting_.load(std::memory_order_relaxed); }

 private:
  // Whether a single call came less than kReserveTime ago.
  bool IsReserved() const;
  void SubmitSlice(Lane& lane, std::function<void()> slice, ClientId client);
  void Work();
  // The rest requires the mutex.
  // The task whose turn it is; none when none may run now.
  std::optional<Task> Next();
  bool MayRunSlice() const;
  void NoteWaiting();

  std::optional<PoolMetrics> single_metrics_;
  std::optional<PoolMetrics> slice_metrics_;
  std::atomic<std::chrono::steady_clock::duration> last_single_call_;
  std::mutex mutex_;
  // The rest is guarded by the mutex, `waiting_` for changes.
  std::condition_variable ready_;
  FairQueue<Task> single_calls_;
  // Lanes with slices.
  FairQueue<Lane*> lanes_;
  size_t slices_waiting_ = 0;
  int slices_running_ = 0;
  std::atomic<size_t> waiting_ = 0;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_TASK_POOL_H_
