#ifndef HULLD_TESTS_SERVER_SCHEDULES_SCHEDULER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_SCHEDULER_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <source_location>
#include <string>
#include <vector>

#include "tests/server/schedules/fiber.h"
#include "tests/server/schedules/random.h"

namespace hulld::server {

// A fault of a schedule.
struct ScheduleFault {
  enum class Kind {
    // Threads wait, and none can run.
    kDeadlock,
    // Like kDeadlock, but the condition of a waiting thread is true: its notification is missing. A
    // wait with a time limit also counts.
    kLostWakeup,
    // The schedule does not terminate.
    kLivelock,
    // An answer, or a change that the store keeps, violates the specification.
    kWrongAnswer,
  };
  Kind kind;
  std::string what;
};

// Runs threads of a test as fibers, one after another. A seed decides which runs next whenever a
// thread takes a mutex, waits, notifies, or calls the store; the same seed produces the same steps.
// Code between two such points is atomic for other threads, so data races are left to
// ThreadSanitizer.
//
// Half of the seeds walk at random, each with its own bias toward staying with the same thread.
// The rest use priorities that change a few times (PCT: Burckhardt, Kothari, Musuvathi and
// Nagarakatte 2010, A Randomized Scheduler with Probabilistic Guarantees of Finding Bugs): a defect
// that needs d steps in a certain order among n threads and k steps is found by at least one in n
// k^(d-1) schedules.
//
// Time advances slightly at each step only. A wait reaches its time limit only if the seed chooses
// so while other threads can run. So if only a time limit could continue the schedule, a wakeup is
// missing, which is a fault. Some seeds also wake threads spuriously, as the standard allows.
class Scheduler {
 public:
  // A schedule with more steps counts as nonterminating. **Observed**: at most 3000.
  static constexpr size_t kMaxSteps = 100'000;
  static constexpr int64_t kNoDeadline = -1;

  using Location = std::source_location;

  // The condition that a thread waits for, if known.
  struct Condition {
    bool (*holds)(const void*) = nullptr;
    const void* context = nullptr;
  };

  // Returns the scheduler that runs on this thread. Requires: one exists.
  static Scheduler& Current();

  explicit Scheduler(uint64_t seed);
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;
  // After a fault, threads and everything they hold are abandoned.
  ~Scheduler();

  // Runs `body` as the first thread, and all threads that it starts, until they end. Call at most
  // once.
  std::optional<ScheduleFault> Run(std::function<void()> body);

  // Returns the steps, one per line.
  std::string Steps() const;
  size_t step_count() const { return steps_.size(); }
  // Returns a digest of all steps, equal for equal schedules.
  uint64_t Digest() const;

  // The rest is for threads of the schedule.

  // Random numbers for the test, independent of those that schedule threads.
  Random& random() { return random_; }
  // Returns nanoseconds since the schedule began.
  int64_t Now() const { return now_; }
  // A step visible to other threads; may switch threads.
  void Yield(const char* what, const void* object = nullptr,
             const Location& where = Location::current());
  // Like Yield, but for the test or its store, with numbers that describe the step.
  void Note(const char* what, uint64_t first = 0, uint64_t second = 0, uint64_t third = 0);
  // Ends the schedule.
  [[noreturn]] void Fail(std::string what);

  size_t StartThread(std::function<void()> task, const char* name, const Location& where);
  void JoinThread(size_t thread);
  // Waits until the thread that holds an object releases it.
  void Block(const char* what, const void* object, const Location& where);
  void Unblock(const void* object);
  // Waits for a notification or the deadline. Returns true if notified.
  bool Wait(const void* object, int64_t deadline, const Condition& condition,
            const Location& where);
  // Waits for notifications until the condition is true.
  void WaitUntil(const void* object, const Condition& condition,
                 const Location& where = Location::current());
  void Notify(const void* object, bool all = true, const Location& where = Location::current());

 private:
  enum class Status : uint8_t { kReady, kBlocked, kWaiting, kDone };
  struct ThreadState {
    Fiber* fiber = nullptr;
    Status status = Status::kReady;
    bool was_notified = false;
    // Blocked or waiting.
    const char* what = nullptr;
    const void* object = nullptr;
    int64_t deadline = kNoDeadline;
    Condition condition = {};
    Location where = {};
    // PCT priority of the thread; the highest runs first.
    int64_t priority = 0;
    const char* name = nullptr;
    Location started = {};
  };
  struct Step {
    uint16_t thread;
    const char* what;
    const void* object;
    uint64_t numbers[3];
    Location where;
    // Caused by another thread or the scheduler.
    bool is_given;
  };

  // Memory for the steps of the next schedule.
  static std::vector<Step> spare_steps_;

  void Record(const char* what, const void* object, const Location& where);
  void GoOn();
  size_t Choose();
  void MayWakeOne();
  void SetStatus(size_t thread, Status status);
  void Suspend();
  ScheduleFault Stuck() const;
  std::string NameOf(size_t thread) const;

  Random choices_;
  Random random_;
  bool by_priority_ = false;
  // Random walk: stays with a thread in this many of 16 steps.
  uint32_t stickiness_ = 0;
  // PCT: the steps at which the running thread gets the lowest priority, descending.
  std::vector<size_t> change_points_;
  int64_t lowest_priority_ = 0;
  // One in this many steps; 0: never.
  uint32_t timeouts_ = 0;
  uint32_t spurious_ = 0;

  int64_t now_ = 0;
  std::vector<ThreadState> threads_;
  // Threads that can run, ascending.
  std::vector<uint16_t> ready_;
  // Temporary.
  std::vector<uint16_t> waiting_;
  size_t running_ = 0;
  // The next thread to resume.
  size_t next_ = 0;
  std::vector<Step> steps_;
  std::optional<ScheduleFault> fault_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_SCHEDULER_H_
