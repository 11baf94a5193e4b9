#ifndef HULLD_SERVER_CALL_SERVICE_PARTS_H_
#define HULLD_SERVER_CALL_SERVICE_PARTS_H_

#include "server/call/admission.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/registry/waiting_calls.h"
#include "server/store/store.h"

namespace hulld::server {

// The parts of the server that its services use.
struct ServiceParts {
  Store& store;
  Registry& registry;
  Admission& admission;
  // Builds chunks and replacements.
  TaskPool& writers;
  // Loads the records and hulls of single pairs. Its tasks may block.
  TaskPool& readers;
  // Like `readers`, for many or large hulls.
  TaskPool& long_readers;
  // Computes answers.
  TaskPool& pool;
  // Waits for freshness without occupying a thread.
  WaitingCalls& waiting;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_SERVICE_PARTS_H_
