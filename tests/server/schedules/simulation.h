#ifndef HULLD_TESTS_SERVER_SCHEDULES_SIMULATION_H_
#define HULLD_TESTS_SERVER_SCHEDULES_SIMULATION_H_

#include <cstdint>
#include <string>

#include "server/registry/registry.h"
#include "tests/server/schedules/scheduler.h"
#include "tests/server/schedules/store/simulated_store.h"

namespace hulld::server {

// Coverage of schedules, so that a test can check that they reach the intended cases.
struct Reached {
  uint64_t schedules = 0;
  uint64_t steps = 0;
  uint64_t answers = 0;
  uint64_t refused = 0;
  uint64_t aborted = 0;
  uint64_t cancelled = 0;
  uint64_t repeated = 0;
  uint64_t gone = 0;
  uint64_t gaps = 0;
  uint64_t overloaded = 0;
  uint64_t damaged = 0;
  uint64_t reads = 0;
  uint64_t snapshots = 0;
  // Changes reported to a watch.
  uint64_t reported = 0;
  uint64_t loads = 0;
  uint64_t sequences = 0;
  uint64_t lookups = 0;
  uint64_t bodies_put = 0;
  uint64_t bodies_deleted = 0;
  uint64_t bodies_found = 0;
  uint64_t kinds_refused = 0;
  // By a collision watch: resolved hulls and bodies, and sent hulls of pieces.
  uint64_t resolved = 0;
  uint64_t pieces_sent = 0;
  uint64_t evictions = 0;
  uint64_t recovered = 0;
  uint64_t kills = 0;
  uint64_t revived = 0;
  // Schedules with several servers, and their rebased changes.
  uint64_t shared = 0;
  uint64_t superseded = 0;
};

// A one-time event that threads wait for.
class Event {
 public:
  bool is_set() const { return is_set_; }
  void Set();
  void Wait(const std::source_location& where = std::source_location::current());

 private:
  bool is_set_ = false;
};

// Parameters of a schedule, drawn from its seed. Omitting many features makes the remaining ones
// interact more often (swarm testing: Groce, Zhang, Eide, Chen and Regehr 2012).
struct Plan {
  explicit Plan(Random& random);

  StoreFaults faults;
  uint64_t memory_limit = 0;
  // If true, the memory limit is reached under pressure only.
  bool has_memory = false;
  // True if the store supports record lookup; and the number of records that a server keeps.
  bool supports_lookup = false;
  size_t records = 0;
  // Servers over one database, and the clients of each.
  size_t servers = 1;
  size_t clients = 0;
  size_t hulls = 0;
  size_t writers = 0;
  bool has_watch = false;
  bool has_collision_watch = false;
  // Relative frequency of each kind of call.
  uint32_t creations = 0;
  uint32_t deletions = 0;
  uint32_t replacements = 0;
  uint32_t streams = 0;
  uint32_t reads = 0;
  uint32_t listings = 0;
  uint32_t bodies = 0;
  uint32_t pressure = 0;
  // One in this many; 0: none.
  uint32_t conditions = 0;
  uint32_t cancellations = 0;
  uint32_t preparations = 0;
  uint32_t repetitions = 0;
};

// State shared by the clients of a schedule.
struct Simulation {
  const Plan& plan;
  SimulatedStore& store;
  Registry& registry;
  Reached& reached;

  Ledger& ledger() const { return store.ledger(); }
};

// Runs one schedule: a registry over a store with faults and clients that call it, then a registry
// over the data that the store kept; or several registries over one database, which start and end
// independently. The body of Scheduler::Run.
void Simulate(Reached& reached);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_SIMULATION_H_
