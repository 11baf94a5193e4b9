#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_INTERRUPT_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_INTERRUPT_H_

#include <signal.h>

#include <functional>
#include <thread>

namespace hulld {

// While this lives, SIGINT (Ctrl-C) and SIGTERM do not end the process but call a function, on a
// thread of its own, so that a command which lasts until then can end as it should. A second signal
// ends the process. One at a time.
class Interrupt {
 public:
  explicit Interrupt(std::function<void()> on_interrupt);
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

 private:
  struct sigaction before_int_;
  struct sigaction before_term_;
  std::thread thread_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_INTERRUPT_H_
