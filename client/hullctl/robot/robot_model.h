#ifndef HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_MODEL_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_MODEL_H_

#include <absl/status/statusor.h>

#include <set>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/command_line/command.h"
#include "client/hullctl/view/temporary_hulls.h"
#include "client/robot/robot.h"
#include "client/robot/shape_hull.h"
#include "client/robot/srdf_file.h"

namespace hulld {

// The options that say what a robot is.
struct RobotArguments {
  std::string urdf;
  // NAME=DIR each.
  std::vector<std::string> packages;
  // Where the hulls of the links stay; empty: they are removed at the end.
  std::string prefix;
};

// Declares FILE, --package and --prefix. `arguments` must outlive the parsing.
void AddRobotArguments(Command command, RobotArguments* arguments);
// What --help says about robots.
extern const char kRobotHelp[];

// A shape of the robot, and the hull that stands for it.
struct RobotPart {
  int link = 0;
  // The link's name, followed by "/1", "/2" and so on where it has several shapes.
  std::string name;
  RigidPose X_LS = kNoMotion;
  ShapeKind kind = ShapeKind::kMesh;
  ShapeHull hull;
  std::string hull_id;
};

struct RobotModel {
  Robot robot;
  std::vector<RobotPart> parts;

  // X_WS of each part, its seven numbers appended to `poses`. free_values: one for each free joint.
  void AppendPoses(const RigidPose& X_WB, const std::vector<double>& free_values,
                   std::vector<double>* poses) const;
  // The pairs of parts of different links, but for those of links in `left_out`: indices into
  // parts, two each.
  std::vector<uint32_t> PairsWithout(const std::set<LinkPair>& left_out) const;
};

// Reads the description and the meshes that it names; no server is asked. INVALID_ARGUMENT and
// NOT_FOUND name file and line.
absl::StatusOr<RobotModel> ReadRobot(const RobotArguments& arguments);

// Makes the server's hulls of all parts and sets their IDs: under the prefix of the arguments,
// where what is there is replaced, or among the temporary ones.
absl::Status RegisterHulls(const RobotArguments& arguments, const Client& client,
                           TemporaryHulls* temporary, RobotModel* model);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_MODEL_H_
