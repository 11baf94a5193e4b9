#ifndef HULLD_TESTS_SERVER_SCHEDULES_COLLISION_WATCHER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_COLLISION_WATCHER_H_

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/collisions/watched_hulls.h"
#include "tests/server/schedules/simulation.h"

namespace hulld::server {

// Watches hulls and bodies as a collision watch does. Fails the schedule if a hull is in use at a
// version that the client did not receive last.
class CollisionWatcher : public std::enable_shared_from_this<CollisionWatcher> {
 public:
  explicit CollisionWatcher(Simulation& simulation)
      : simulation_(simulation), hulls_(simulation.registry) {}

  // Runs until End.
  void Run();
  // Blocks until the watch has the final state of the store, then ends it. A lost change therefore
  // appears as a thread that waits forever. Requires that all clients have ended.
  void End();

 private:
  // create_revision and revision of a hull or body.
  using Version = std::pair<uint64_t, uint64_t>;

  bool MayFail(const absl::Status& status) const;
  // Returns false if the watch ended.
  bool Receive(absl::StatusOr<WatchedHulls::Round> round);
  void CheckSent(const HullRecord& hull) const;
  bool IsCurrent() const;
  bool IsCurrent(size_t hull, const absl::StatusOr<HullView>& view) const;

  Simulation& simulation_;
  WatchedHulls hulls_;
  std::vector<std::string> ids_;
  // Parallel to ids_.
  std::vector<absl::StatusOr<HullView>> views_;
  // Last version sent to the client, by ID.
  std::map<std::string, Version> sent_;
  bool has_begun_ = false;
  bool is_over_ = false;
  bool is_ready_ = false;
  bool is_ending_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_COLLISION_WATCHER_H_
