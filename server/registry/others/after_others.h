#ifndef HULLD_SERVER_REGISTRY_OTHERS_AFTER_OTHERS_H_
#define HULLD_SERVER_REGISTRY_OTHERS_AFTER_OTHERS_H_

#include <utility>
#include <vector>

#include "server/registry/memory/locked.h"

namespace hulld::server {

// Tasks deferred until all known peer changes are applied: they depend on an ID that a peer server
// changed, and must see its new state. Takeover runs them after the change that deferred them.
// Guarded by the registry's mutex.
class AfterOthers {
 public:
  void Add(LockedTask task) { tasks_.push_back(std::move(task)); }
  // Runs the present tasks in order. Tasks that they add wait for the next run.
  void Run(Locked& locked) {
    for (const LockedTask& task : std::exchange(tasks_, {})) task(locked);
  }

 private:
  std::vector<LockedTask> tasks_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_OTHERS_AFTER_OTHERS_H_
