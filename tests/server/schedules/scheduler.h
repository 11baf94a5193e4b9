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

// What is wrong with a schedule.
struct ScheduleFault {
  enum class Kind {
    // Threads wait, and none can go on.
    kDeadlock,
    // The same, and what one of them waits for has come: nobody woke it. A wait that ends by its
    // time limit is no excuse.
    kLostWakeup,
    // It does not come to an end.
    kLivelock,
    // An answer, or what the store keeps, is not what the specification says.
    kWrongAnswer,
  };
  Kind kind;
  std::string what;
};

// Runs threads of a test as fibers, one at a time, and decides by a seed who goes on whenever one
// takes a mutex, waits, notifies, or calls the store: the same seed, the same steps. What a thread
// does between two such points is one step for others, so races on memory are not found here but by
// ThreadSanitizer.
//
// Half of the seeds walk at random, with a bias of their own towards staying with the same thread.
// The others go by priorities that change a few times (PCT: Burckhardt, Kothari, Musuvathi and
// Nagarakatte 2010, A Randomized Scheduler with Probabilistic Guarantees of Finding Bugs): a defect
// that needs d steps in a certain order among n threads and k steps is found by one schedule in
// n k^(d-1) at least.
//
// Time stands still but for a moment at each step. A wait with a time limit ends by it only if the
// seed says so while others could go on. So where nothing can go on but by a time limit, a wakeup
// is missing, which is a fault. Some seeds also wake threads that nobody notified, as the standard
// allows.
class Scheduler {
 public:
  // A schedule of more steps than this does not end. Observed: 3 000 at most.
  static constexpr size_t kMostSteps = 100'000;
  static constexpr int64_t kNoDeadline = -1;

  using Location = std::source_location;

  // What a thread waits for, if it is known.
  struct Condition {
    bool (*holds)(const void*) = nullptr;
    const void* context = nullptr;
  };

  // The scheduler of the schedule that runs on this thread. There must be one.
  static Scheduler& Current();

  explicit Scheduler(uint64_t seed);
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;
  // After a fault the threads and all that they hold are left as they are.
  ~Scheduler();

  // Runs `body` as the first thread, and whatever it starts, until all ended. Once.
  std::optional<ScheduleFault> Run(std::function<void()> body);

  // What happened, a line for each step.
  std::string Steps() const;
  size_t step_count() const { return steps_.size(); }
  // A digest of all steps, equal for equal schedules.
  uint64_t Digest() const;

  // The rest is for threads of the schedule.

  // Numbers for what a test does, apart from those that choose who goes on.
  Random& random() { return random_; }
  // Nanoseconds since the schedule began.
  int64_t Now() const { return now_; }
  // A step that others can see: who goes on next?
  void Yield(const char* what, const void* object = nullptr,
             const Location& where = Location::current());
  // The same, of a test or of its store, with numbers that tell of it.
  void Note(const char* what, uint64_t first = 0, uint64_t second = 0, uint64_t third = 0);
  // Ends the schedule.
  [[noreturn]] void Fail(std::string what);

  size_t StartThread(std::function<void()> task, const char* name, const Location& where);
  void JoinThread(size_t thread);
  // Waits until the thread that holds an object lets go of it.
  void Block(const char* what, const void* object, const Location& where);
  void Unblock(const void* object);
  // Waits for a notification, which is true, or for the deadline.
  bool Wait(const void* object, int64_t deadline, const Condition& condition,
            const Location& where);
  void Notify(const void* object, bool all, const Location& where);

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
    // The thread's priority in PCT; the highest goes first.
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
    // Not the thread's own doing.
    bool is_given;
  };

  void Record(const char* what, const void* object, const Location& where);
  void GoOn();
  std::optional<size_t> Choose();
  void MayWakeOne();
  size_t ChooseAmong(const std::vector<uint16_t>& ready);
  void Suspend();
  ScheduleFault Stuck() const;
  std::string NameOf(size_t thread) const;

  Random choices_;
  Random random_;
  bool by_priority_ = false;
  // Walk: stays with a thread in this many of 16 steps.
  uint32_t stickiness_ = 0;
  // PCT: the steps at which the running thread gets the lowest priority, descending.
  std::vector<size_t> change_points_;
  int64_t lowest_priority_ = 0;
  // Once in this many steps; 0: never.
  uint32_t timeouts_ = 0;
  uint32_t spurious_ = 0;

  int64_t now_ = 0;
  std::vector<ThreadState> threads_;
  std::vector<uint16_t> ready_;
  size_t running_ = 0;
  // Whom to resume.
  size_t next_ = 0;
  std::vector<Step> steps_;
  std::optional<ScheduleFault> fault_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_SCHEDULER_H_
