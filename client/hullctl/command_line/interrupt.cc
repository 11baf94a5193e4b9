#include "client/hullctl/command_line/interrupt.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <utility>

namespace hulld {
namespace {

// Increments of the event counter: a signal, or the end.
constexpr uint64_t kSignal = 1;
constexpr uint64_t kEnd = uint64_t{1} << 32;

// Event descriptor. The signal handler, which may call only a few functions, increments its
// counter.
std::atomic<int> event = -1;
std::atomic<bool> arrived = false;

void Count(uint64_t what) {
  const int before = errno;
  [[maybe_unused]] const auto written = write(event, &what, sizeof what);
  errno = before;
}

extern "C" void HandleSignal(int) {
  arrived = true;
  Count(kSignal);
}

}  // namespace

Interrupt::Interrupt(std::function<void()> on_interrupt) {
  arrived = false;
  event = eventfd(0, EFD_CLOEXEC);
  thread_ = std::thread([call = std::move(on_interrupt)] {
    while (true) {
      uint64_t counted = 0;
      if (read(event, &counted, sizeof counted) != sizeof counted) continue;
      if (counted % kEnd > 0) call();
      if (counted >= kEnd) return;
    }
  });
  struct sigaction action = {};
  action.sa_handler = HandleSignal;
  // Restores the previous action for the second signal.
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigaction(SIGINT, &action, &before_int_);
  sigaction(SIGTERM, &action, &before_term_);
}

Interrupt::~Interrupt() {
  sigaction(SIGINT, &before_int_, nullptr);
  sigaction(SIGTERM, &before_term_, nullptr);
  Count(kEnd);
  thread_.join();
  close(event);
  event = -1;
}

bool Interrupt::has_arrived() const { return arrived; }

}  // namespace hulld
