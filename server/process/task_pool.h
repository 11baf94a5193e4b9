#ifndef HULLD_SERVER_PROCESS_TASK_POOL_H_
#define HULLD_SERVER_PROCESS_TASK_POOL_H_

#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "server/process/fair_queue.h"
#include "server/process/metrics.h"
#include "server/process/synchronization.h"

namespace hulld::server {

// Threads that run tasks at the priority of the process. They take tasks from two queues. Single
// tasks come first: clients take turns, and the tasks of a client stay in order of arrival. Slices
// of long calls come next: each long call has a lane; clients take turns, and so do the lanes of a
// client, one slice each. A slice takes about kSliceTime, so a single task waits for at most one
// slice, and no thread waits for another.
//
// gRPC calls back on as few as two threads, which must stay free to move bytes, so all longer work
// runs on a pool. Tasks of a pool with lanes must neither block nor wait.
class TaskPool {
 private:
  struct Task {
    std::function<void()> run;
    SteadyClock::time_point submitted;
    bool is_slice;
  };

 public:
  // Duration of a slice: about the time that the answer of a single call takes over the wire, and a
  // hundred times the cost of a task switch (**observed**: 2 us). Not tuned.
  static constexpr std::chrono::microseconds kSliceTime{250};
  // While single calls arrive, and for this long afterwards, slices leave one core free for them.
  // Otherwise, the kernel would let a computing thread run for a few milliseconds (a tick of Linux
  // is 1 to 10 ms) before it schedules the gRPC threads that deliver the calls.
  static constexpr std::chrono::milliseconds kReserveTime{20};
  // During that time, a thread pauses for this long after each slice, so that the kernel gives its
  // core to waiting threads of gRPC and of clients on this machine. Otherwise, this thread would
  // keep the core until the next tick. **Observed** on two cores: during batches, the p99 of single
  // calls is 2.2 to 3.0 times that of an idle server, or 7 to 9 times without pauses. Pauses reduce
  // the throughput of batches by a third to a half (tests/bench/results/server_overload_*.csv).
  static constexpr std::chrono::microseconds kPauseTime{80};

  // Slices of a long call. Requires at destruction: no slice is queued; each slice should therefore
  // hold a reference to the lane's owner.
  class Lane {
   public:
    // The pool must outlive this.
    explicit Lane(TaskPool& pool) : pool_(pool) {}
    Lane(const Lane&) = delete;
    Lane& operator=(const Lane&) = delete;
    ~Lane();

    // Queues a slice. Slices of a lane start in order of submission, on any thread; several may run
    // concurrently. client: the client that waits for it, the same for all slices of a lane.
    void Submit(std::function<void()> slice, ClientId client = kNoClient);

   private:
    friend class TaskPool;

    TaskPool& pool_;
    // The pool's mutex guards the members below.
    ClientId client_ = kNoClient;
    // The lane is scheduled unless this is empty.
    std::deque<Task> slices_;
  };

  // metrics: metrics of the queues of single tasks and of slices. Requires threads > 0.
  explicit TaskPool(int threads, std::optional<PoolMetrics> single_metrics = std::nullopt,
                    std::optional<PoolMetrics> slice_metrics = std::nullopt);
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;
  // Runs the queued tasks, then ends.
  ~TaskPool();

  size_t threads() const { return threads_.size(); }

  // Queues a task ahead of all slices. client: the client that waits for it. is_last: true if this
  // is the last action of a task of this pool, whose thread then takes the queued task if it is the
  // only one, so that no other thread is woken.
  void Submit(std::function<void()> task, ClientId client = kNoClient, bool is_last = false);

  // Records a single call answered without this pool, so that slices leave it a core. Cost: ~30 ns.
  void NoteSingleCall();

  // Number of single tasks waiting for a thread.
  size_t waiting() const { return waiting_.load(std::memory_order_relaxed); }

 private:
  // True if a single call arrived less than kReserveTime ago.
  bool IsReserved() const;
  void Work();
  // The functions below require the mutex.
  //
  // Returns the next task; nullopt if none may run now.
  std::optional<Task> Next();
  bool MayRunSlice() const;
  void NoteWaiting();

  std::optional<PoolMetrics> single_metrics_;
  std::optional<PoolMetrics> slice_metrics_;
  std::atomic<SteadyClock::duration> last_single_call_;
  Mutex mutex_;
  // The mutex guards the members below, and changes of `waiting_`.
  ConditionVariable ready_;
  FairQueue<Task> single_tasks_;
  // Lanes with slices.
  FairQueue<Lane*> lanes_;
  size_t slices_waiting_ = 0;
  size_t slices_running_ = 0;
  std::atomic<size_t> waiting_ = 0;
  bool ending_ = false;
  std::vector<Thread> threads_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_TASK_POOL_H_
