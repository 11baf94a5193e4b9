#ifndef HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_MODEL_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_MODEL_H_

#include <absl/status/statusor.h>

#include <set>
#include <span>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/formats/mesh_file.h"
#include "client/hullctl/command_line/command.h"
#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/robot/mesh_pieces.h"
#include "client/robot/robot.h"
#include "client/robot/shape_hull.h"
#include "client/robot/srdf_file.h"

namespace hulld {

// Options that describe a robot.
struct RobotArguments {
  std::string urdf;
  // NAME=DIR each.
  std::vector<std::string> packages;
  MeshSplit split = MeshSplit::kAutomatic;
  // ID prefix for registering the hulls of the links. Empty: each query sends them as inline
  // shapes.
  std::string prefix;
};

// Declares FILE, --package, --split, and --prefix. `arguments` must outlive the parsing.
void AddRobotArguments(Command command, RobotArguments* arguments);
// Text about robots in --help.
extern const char kRobotHelp[];

// A shape of the robot, or a piece of a shape, and its hull.
struct RobotPart {
  int link = 0;
  // The link's name, followed by "/1", "/2", and so on if it has several parts.
  std::string name;
  RigidPose X_LS = kNoMotion;
  ShapeHull hull;
  // Surface, as in MeshPiece; dropped by PrepareHulls.
  TriangleMesh mesh;
  // Empty: an inline shape.
  std::string hull_id;
};

struct RobotModel {
  Robot robot;
  std::vector<RobotPart> parts;
  // Meshes with several pieces: "forearm: 5 pieces of meshes/forearm.obj".
  std::vector<std::string> notes;

  // Appends X_WS of each part, seven numbers each, to `poses`. joint_values: as for LinkPoses.
  void AppendPoses(const RigidPose& X_WB, std::span<const JointValue> joint_values,
                   std::vector<double>* poses) const;
  // Returns the pairs of parts of different links, except for pairs of links in `left_out`: two
  // indices into parts each.
  std::vector<uint32_t> PairsWithout(const std::set<LinkPair>& left_out) const;
};

// Reads the description and its meshes; uses no server. INVALID_ARGUMENT and NOT_FOUND name file
// and line.
absl::StatusOr<RobotModel> ReadRobot(const RobotArguments& arguments);

// Prepares the hulls of all parts for queries. With a prefix, registers them under it and sets
// their IDs; replaces existing hulls. With --local, does the same without a prefix. Otherwise makes
// them inline shapes: a private server reduces a mesh to the vertices of its hull. Warns of each
// hull that is much larger than its mesh (kVolumeRatioToWarn). INVALID_ARGUMENT: a hull has more
// vertices than an inline shape may have. Errors of the servers; without a local server, a mesh of
// few points is sent as it is.
absl::Status PrepareHulls(const Invocation& run, const RobotArguments& arguments,
                          const Client& client, RobotModel* model);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_ROBOT_MODEL_H_
