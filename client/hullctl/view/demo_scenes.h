#ifndef HULLD_CLIENT_HULLCTL_VIEW_DEMO_SCENES_H_
#define HULLD_CLIENT_HULLCTL_VIEW_DEMO_SCENES_H_

#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/temporary_hulls.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// A hull that grows while it is displayed: points in balls of increasing radius are streamed into
// it. The destructor stops the growth.
class GrowingHull {
 public:
  // Requires that `hull_id` exists. Growth starts with Restart.
  GrowingHull(const Client& client, std::string hull_id);

  // Replaces the hull and grows it from the start. Does not wait.
  void Restart();

 private:
  void Run(const std::stop_token& stop);
  // Grows the hull until it is complete, or another start is requested.
  void Grow(uint64_t start, const std::stop_token& stop);

  const Client& client_;
  const std::string hull_id_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  // Guarded by the mutex: number of calls of Restart.
  uint64_t starts_ = 0;
  // Stopped and joined first.
  std::jthread thread_;
};

// Creates the textbook's scenes, also used by client/demo.sh, keys 0 to 7:
//   0  two Spiders far apart            4  two Wusons that overlap by one part in 10^12
//   1  two Spiders that overlap         5  cubes that share a face, an edge and a corner
//   2  two Spiders that share a vertex  6  two balls, of 3000 and 100 random points
//   3  two Wusons that share a vertex   7  a hull that grows until it reaches a ball
// Their hulls are temporary. Spider and Wuson come from Debian's assimp-testmodels.
absl::StatusOr<std::vector<ViewScene>> MakeDemoScenes(const Client& client, TemporaryHulls* hulls);

inline constexpr char kGrowingSceneKey[] = "7";
// The growing hull is the first object of this scene.
inline constexpr size_t kGrowingObject = 0;

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_DEMO_SCENES_H_
