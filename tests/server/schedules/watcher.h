#ifndef HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_

#include <array>
#include <memory>
#include <optional>

#include "tests/server/schedules/simulation.h"

namespace hulld::server {

// Watches all hulls. Fails the schedule if the watch reports a state that never existed.
class Watcher : public std::enable_shared_from_this<Watcher> {
 public:
  explicit Watcher(Simulation& simulation) : simulation_(simulation) {}

  // Runs until End.
  void Run();
  // Blocks until the watch has the final state of the store, then ends it. A lost change therefore
  // appears as a thread that waits forever. Requires that all clients have ended.
  void End();

 private:
  void Receive(const HullChange& change);
  bool MayBeOfKind(size_t hull, const HullChange& change, size_t state) const;
  bool IsCurrent() const;

  Simulation& simulation_;
  std::shared_ptr<Watch> watch_;
  bool has_begun_ = false;
  bool is_refused_ = false;
  bool is_ready_ = false;
  bool is_ending_ = false;
  // Revision of the last batch; 0 before the listing ends.
  uint64_t revision_ = 0;
  // The last reported state of each hull, as an index into the ledger.
  std::array<size_t, kHulls> reported_{};
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_WATCHER_H_
