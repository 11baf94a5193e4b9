#ifndef HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_

#include <array>
#include <memory>
#include <optional>

#include "tests/server/schedules/simulation.h"

namespace hulld::server {

// A watch of all hulls. Fails the schedule if it receives an event of a state that never existed.
class Watcher : public std::enable_shared_from_this<Watcher> {
 public:
  explicit Watcher(Simulation& simulation) : simulation_(simulation) {}

  // Receives events until End.
  void Run();
  // Waits until the watch has received the stored state of every hull, then ends it. A change that
  // is never reported thus appears as a thread that waits forever. Requires: no client is left.
  void End();

 private:
  void WaitUntilReady();
  void Take(const HullChange& change);
  bool MayBeOfKind(size_t hull, const HullChange& change, size_t state) const;
  bool KnowsAll() const;

  Simulation& simulation_;
  std::shared_ptr<ChangeWatch> watch_;
  bool has_begun_ = false;
  bool is_refused_ = false;
  bool is_ready_ = false;
  bool is_ending_ = false;
  // Everything up to this revision was received; 0 before the first header.
  uint64_t revision_ = 0;
  // Number of the last received state of each hull.
  std::array<size_t, kHulls> told_{};
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_
