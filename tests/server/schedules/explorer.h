#ifndef HULLD_TESTS_SERVER_SCHEDULES_EXPLORER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_EXPLORER_H_

#include <cstdint>
#include <optional>
#include <string>

#include "tests/server/schedules/scheduler.h"
#include "tests/server/schedules/simulation.h"

namespace hulld::server {

// A schedule of the registry with a fault.
struct FoundFault {
  uint64_t seed = 0;
  // With it.
  uint64_t schedules = 0;
  ScheduleFault fault;
  std::string steps;
};

// Runs the schedules of this many seeds, until one has a fault; nothing is to be explored in the
// process after that. A broken invariant (HULLD_CHECK) prints its seed and its steps as it ends the
// process.
std::optional<FoundFault> Explore(uint64_t first_seed, uint64_t count, Reached& reached);

// A digest of the steps of one schedule, which has no fault.
uint64_t DigestOf(uint64_t seed);

// The seed, how to run it again, what is wrong, and the steps.
std::string Report(const FoundFault& found);

// A number in the environment.
uint64_t NumberIn(const char* variable, uint64_t otherwise);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_EXPLORER_H_
