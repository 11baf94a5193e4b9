#ifndef HULLD_SERVER_COLLISIONS_PLACED_COLLISION_PARTS_H_
#define HULLD_SERVER_COLLISIONS_PLACED_COLLISION_PARTS_H_

#include "server/call/admission.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/registry/waiting_calls.h"

namespace hulld::server {

// The parts of the server that collision calls use.
struct CollisionParts {
  Registry& registry;
  Admission& admission;
  // For steps that may block: for the hulls of one pair, and for many hulls.
  TaskPool& readers;
  TaskPool& long_readers;
  TaskPool& pool;
  // Waits for freshness without occupying a thread.
  WaitingCalls& waiting;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_COLLISION_PARTS_H_
