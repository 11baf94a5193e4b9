#ifndef HULLD_SERVER_REGISTRY_OTHERS_AFTER_OTHERS_H_
#define HULLD_SERVER_REGISTRY_OTHERS_AFTER_OTHERS_H_

#include <utility>
#include <vector>

#include "server/registry/memory/locked.h"

namespace hulld::server {

// What goes on once all that other servers did is taken over: work that depends on an ID which one
// of them changed, and which is to find what is there by then. Takeover runs it, after the change
// that made it wait. Guarded by the registry's mutex.
class AfterOthers {
 public:
  void Add(LockedTask task) { tasks_.push_back(std::move(task)); }
  // Runs those that are here by now, in their order. What they add waits for the next time.
  void Run(Locked& locked) {
    for (const LockedTask& task : std::exchange(tasks_, {})) task(locked);
  }

 private:
  std::vector<LockedTask> tasks_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_OTHERS_AFTER_OTHERS_H_
