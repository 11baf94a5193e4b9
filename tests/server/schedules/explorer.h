#ifndef HULLD_TESTS_SERVER_SCHEDULES_EXPLORER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_EXPLORER_H_

#include <cstdint>
#include <optional>
#include <string>

#include "tests/server/schedules/scheduler.h"
#include "tests/server/schedules/simulation.h"

namespace hulld::server {

// A registry schedule with a fault.
struct FoundFault {
  uint64_t seed = 0;
  // Schedules run, including this one.
  uint64_t schedules = 0;
  ScheduleFault fault;
  std::string steps;
};

// Runs the schedules of this many seeds until one has a fault; the process cannot explore after
// that. A broken invariant (HULLD_CHECK) prints its seed and steps, then ends the process.
std::optional<FoundFault> Explore(uint64_t first_seed, uint64_t count, Reached& reached);

// Returns a digest of the steps of one schedule. Requires: the schedule has no fault.
uint64_t DigestOf(uint64_t seed);

// Returns the seed, the command to reproduce it, the fault, and the steps.
std::string Report(const FoundFault& found);

// Returns a number from the environment.
uint64_t NumberIn(const char* variable, uint64_t otherwise);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_EXPLORER_H_
