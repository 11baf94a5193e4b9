#ifndef HULLD_TESTS_SERVER_SCHEDULES_FIBER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_FIBER_H_

#include <boost/context/fiber.hpp>
#include <cstddef>
#include <functional>

namespace hulld::server {

// A stack of its own that runs one task after another, each until it suspends itself. All fibers of
// a thread run on that thread, one at a time. Cost of a switch: some 10 ns.
//
// AddressSanitizer is told of each switch. A fiber is never destroyed: the stack of a task that
// hangs cannot be unwound. It is used again, or abandoned.
class Fiber {
 public:
  Fiber();
  Fiber(const Fiber&) = delete;
  Fiber& operator=(const Fiber&) = delete;
  ~Fiber() = delete;

  // The next Resume begins the task. Requires that the one before has ended.
  void Start(std::function<void()> task);
  // Runs the task until it suspends or ends. Returns whether it ended. Not within a fiber.
  bool Resume();
  // Within the task: returns to the caller of Resume.
  void Suspend();
  // Not within a fiber: its task is never resumed. The fiber is not used again, and what its stack
  // refers to does not count as leaked.
  void Abandon();

 private:
  void Run();

  std::function<void()> task_;
  bool has_ended_ = true;
  boost::context::fiber inside_;
  boost::context::fiber outside_;
  // For the sanitizer: the two stacks, and where it keeps what is on them.
  const void* bottom_ = nullptr;
  size_t size_ = 0;
  const void* outside_bottom_ = nullptr;
  size_t outside_size_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_FIBER_H_
