#include "server/process/thread_priority.h"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>

namespace hulld::server {
namespace {

// How long a thread runs before another that is due takes its core, and, as whoever asks for short
// turns is due sooner, how long it waits for one: the least that Linux takes, instead of some
// milliseconds (a slice of EEVDF, since Linux 6.12; ignored before).
constexpr uint64_t kSliceNanoseconds = 100'000;

// The first version of Linux's struct sched_attr, which no header of glibc 2.36 declares.
struct SchedulingAttributes {
  uint32_t size;
  uint32_t policy;  // 0: SCHED_OTHER
  uint64_t flags;
  int32_t nice;
  uint32_t priority;
  uint64_t runtime;  // of SCHED_OTHER: the slice
  uint64_t deadline;
  uint64_t period;
};

// Whoever has put the process under another policy knows better.
void SetAttributes(int nice) {
  if (sched_getscheduler(0) != SCHED_OTHER) return;
  SchedulingAttributes attributes = {};
  attributes.size = sizeof attributes;
  attributes.nice = nice;
  attributes.runtime = kSliceNanoseconds;
  syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

void PreferShortTurns() { SetAttributes(getpriority(PRIO_PROCESS, 0)); }

void LowerPriority(int niceness) { SetAttributes(getpriority(PRIO_PROCESS, 0) + niceness); }

}  // namespace hulld::server
