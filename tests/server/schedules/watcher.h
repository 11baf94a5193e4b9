#ifndef HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_

#include <array>
#include <memory>
#include <optional>

#include "tests/server/schedules/simulation.h"

namespace hulld::server {

// Watches all hulls, and ends the schedule when it is told what never was.
class Watcher : public std::enable_shared_from_this<Watcher> {
 public:
  explicit Watcher(Simulation& simulation) : simulation_(simulation) {}

  // Until End.
  void Run();
  // Waits until the watch was told all that the store keeps, and ends it. So a change that nobody
  // tells it of is a thread that waits for ever. No client may be left.
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
  // Up to which all was told; 0 before that is known.
  uint64_t revision_ = 0;
  // What it was told last of each hull, by the number of its state.
  std::array<size_t, kHulls> told_{};
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_
