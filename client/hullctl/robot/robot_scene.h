#ifndef HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_SCENE_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_SCENE_H_

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/robot/robot_model.h"
#include "client/hullctl/view/temporary_hulls.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// A robot to show.
struct RobotSceneArguments {
  RobotArguments robot;
  // Semantic description; empty: adjacent links are not queried.
  std::string srdf;
  // Table of waypoints; empty: none.
  std::string joints;
  // File of the surroundings; empty: none.
  std::string scene;
  // Excluded pairs, as for RemoveIgnored.
  std::vector<std::string> ignored;
};

// Adds the parts of the robot to an empty scene, with its joints, its trajectory, and its
// surroundings, and checks the waypoints. The hulls of the parts are temporary. INVALID_ARGUMENT
// and NOT_FOUND name the file and its defect; errors of the calls.
absl::Status AddRobot(const RobotSceneArguments& arguments, const Client& client,
                      TemporaryHulls* temporary, ViewScene* scene);

// The page receives all waypoints at once.
inline constexpr size_t kMaxShownWaypoints = 10'000;

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_SCENE_H_
