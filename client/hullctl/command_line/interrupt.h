#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_INTERRUPT_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_INTERRUPT_H_

#include <signal.h>

#include <functional>
#include <thread>

namespace hulld {

// While an instance exists, SIGINT (Ctrl-C) and SIGTERM do not end the process but call a function
// on a separate thread, so that a long-running command can end cleanly. A second signal ends the
// process. At most one instance may exist.
class Interrupt {
 public:
  explicit Interrupt(std::function<void()> on_interrupt = [] {});
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  // True after a signal; on the main thread, before a system call that it interrupted returns.
  bool has_arrived() const;

 private:
  struct sigaction before_int_;
  struct sigaction before_term_;
  std::thread thread_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_INTERRUPT_H_
