#include "tests/server/schedules/explorer.h"

#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

namespace hulld::server {
namespace {

// For the report of a broken invariant.
uint64_t running_seed = 0;
const Scheduler* running = nullptr;

std::string Heading(uint64_t seed, const std::string& what) {
  return absl::StrCat("seed ", seed, " (to reproduce: HULLD_TEST_SEED=", seed,
                      " HULLD_SCHEDULES=1): ", what, "\n");
}

// Generally unsafe in a signal handler; here the running code calls abort() itself, not from within
// another library.
void ReportAbort(int) {
  if (running == nullptr) return;
  const std::string text =
      Heading(running_seed, "an invariant is violated; steps:") + running->Steps();
  std::fputs(text.c_str(), stderr);
}

void Prepare() {
  static const bool once = [] {
    spdlog::set_level(spdlog::level::off);
    std::signal(SIGABRT, ReportAbort);
    return true;
  }();
  static_cast<void>(once);
}

const char* NameOf(ScheduleFault::Kind kind) {
  switch (kind) {
    case ScheduleFault::Kind::kDeadlock:
      return "a hang";
    case ScheduleFault::Kind::kLostWakeup:
      return "a lost wakeup";
    case ScheduleFault::Kind::kLivelock:
      return "no end";
    case ScheduleFault::Kind::kWrongAnswer:
      return "a violation of the specification";
  }
  return "";
}

}  // namespace

std::optional<FoundFault> Explore(uint64_t first_seed, uint64_t count, Reached& reached) {
  Prepare();
  for (uint64_t i = 0; i < count; ++i) {
    Scheduler scheduler(first_seed + i);
    running_seed = first_seed + i;
    running = &scheduler;
    std::optional<ScheduleFault> fault = scheduler.Run([&reached] { Simulate(reached); });
    running = nullptr;
    ++reached.schedules;
    reached.steps += scheduler.step_count();
    if (fault.has_value()) {
      return FoundFault{first_seed + i, i + 1, *std::move(fault), scheduler.Steps()};
    }
  }
  return std::nullopt;
}

uint64_t DigestOf(uint64_t seed) {
  Prepare();
  Reached reached;
  Scheduler scheduler(seed);
  scheduler.Run([&reached] { Simulate(reached); });
  return scheduler.Digest();
}

std::string Report(const FoundFault& found) {
  return absl::StrCat(Heading(found.seed, NameOf(found.fault.kind)), found.fault.what,
                      "\nthe steps:\n", found.steps);
}

uint64_t NumberIn(const char* variable, uint64_t otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

}  // namespace hulld::server
