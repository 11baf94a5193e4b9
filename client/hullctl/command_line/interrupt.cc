#include "client/hullctl/command_line/interrupt.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <utility>

namespace hulld {

Interrupt::Interrupt(std::function<void()> on_interrupt) {
  sigset_t taken;
  sigemptyset(&taken);
  sigaddset(&taken, SIGINT);
  sigaddset(&taken, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &taken, &before_);
  signals_ = signalfd(-1, &taken, SFD_CLOEXEC);
  end_ = eventfd(0, EFD_CLOEXEC);
  thread_ = std::thread([this, call = std::move(on_interrupt)] {
    while (true) {
      pollfd ready[] = {{signals_, POLLIN, 0}, {end_, POLLIN, 0}};
      if (poll(ready, 2, -1) < 0) continue;
      if (ready[1].revents != 0) return;
      signalfd_siginfo which;
      if (read(signals_, &which, sizeof which) == sizeof which) call();
    }
  });
}

Interrupt::~Interrupt() {
  eventfd_write(end_, 1);
  thread_.join();
  close(end_);
  close(signals_);
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

}  // namespace hulld
