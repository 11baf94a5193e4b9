#ifndef HULLD_CLIENT_HULLCTL_VIEW_DEMO_SCENES_H_
#define HULLD_CLIENT_HULLCTL_VIEW_DEMO_SCENES_H_

#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/temporary_hulls.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// A hull that grows while it is looked at: ever larger balls of points are streamed into it.
class GrowingHull {
 public:
  // `hull_id` is there already; it waits for Restart.
  GrowingHull(const Client& client, std::string hull_id);
  // Stops growing.
  ~GrowingHull();

  // Grows from the start, in place of what there was. Does not wait.
  void Restart();

 private:
  void Run();
  // Until it is grown, or another start is wanted.
  void Grow(uint64_t start);

  const Client& client_;
  const std::string hull_id_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by the mutex: counts calls of Restart.
  uint64_t starts_ = 0;
  bool ended_ = false;
  std::thread thread_;
};

// The textbook's scenes, which client/demo.sh asks about, keys 0 to 7:
//   0  two Spiders far apart            4  two Wusons that overlap by a part in 10^12
//   1  two Spiders that overlap         5  cubes that share a face, an edge and a corner
//   2  two Spiders that share a vertex  6  two balls, of 3000 and 100 random points
//   3  two Wusons that share a vertex   7  a hull that grows until it reaches a ball
// Their hulls are temporary. Spider and Wuson come from Debian's assimp-testmodels.
absl::StatusOr<std::vector<ViewScene>> MakeDemoScenes(const Client& client, TemporaryHulls* hulls);

inline constexpr char kGrowingSceneKey[] = "7";
// The scene of that key starts with the hull that grows.
inline constexpr size_t kGrowingObject = 0;

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_DEMO_SCENES_H_
