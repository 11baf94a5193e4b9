#include "client/hullctl/robot/robot_model.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "client/formats/text_number.h"
#include "client/hullctl/body/hull_segment.h"
#include "client/point_messages.h"
#include "client/robot/package_path.h"
#include "client/robot/urdf_file.h"

namespace hulld {

const char kRobotHelp[] =
    "FILE is a robot description (URDF). Each shape that collides becomes a hull of its own, in "
    "its\n"
    "own frame: a mesh its convex hull, a box itself, and cylinders, spheres and capsules "
    "polyhedra\n"
    "around them; how far these reach beyond the shape is printed. The hulls are removed at the\n"
    "end unless --prefix keeps them. Meshes are obj, stl, ply, off, gltf or dae. A "
    "package://NAME/\n"
    "is found by --package, in ROS_PACKAGE_PATH, in AMENT_PREFIX_PATH, and in the folders above "
    "FILE.\n"
    "Metres and radians, as in URDF. Poses are computed in floating point; answers are exact for\n"
    "those poses.\n";

namespace {

std::string EnvironmentOf(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

absl::StatusOr<PackagePaths> PathsOf(const RobotArguments& arguments) {
  PackagePaths paths;
  paths.description = arguments.urdf == "-" ? "./-" : arguments.urdf;
  for (const std::string& package : arguments.packages) {
    const size_t equals = package.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == package.size()) {
      return absl::InvalidArgumentError(
          absl::StrCat("--package: ", Quoted(package), " is not NAME=DIR"));
    }
    paths.named[package.substr(0, equals)] = package.substr(equals + 1);
  }
  paths.ros_package_path = SplitPath(EnvironmentOf("ROS_PACKAGE_PATH"));
  paths.ament_prefix_path = SplitPath(EnvironmentOf("AMENT_PREFIX_PATH"));
  return paths;
}

absl::StatusOr<ShapeHull> HullOf(const CollisionShape& shape, const PackagePaths& paths) {
  if (shape.kind != ShapeKind::kMesh) return PrimitiveHull(shape);
  const auto file = ResolveFile(paths, shape.mesh);
  if (!file.ok()) return file.status();
  return MeshHull(shape, *file);
}

}  // namespace

void AddRobotArguments(Command command, RobotArguments* arguments) {
  command.AddText("FILE", &arguments->urdf, "The robot description (URDF); - is standard input")
      .Required();
  command
      .AddRepeated("--package", &arguments->packages,
                   "Where the package of that name is; may be given again")
      .ValueName("NAME=DIR");
  command
      .AddText("--prefix", &arguments->prefix,
               "Keep the hulls of the links under this, such as arm/ (default: remove them)")
      .ValueName("PREFIX");
}

void RobotModel::AppendPoses(const RigidPose& X_WB, const std::vector<double>& free_values,
                             std::vector<double>* poses) const {
  const std::vector<double> values = AllJointValues(robot, free_values);
  const std::vector<RigidPose> X_WL = LinkPoses(robot, X_WB, values);
  for (const RobotPart& part : parts) {
    const RigidPose X_WS = Compose(X_WL[static_cast<size_t>(part.link)], part.X_LS);
    poses->insert(poses->end(), X_WS.begin(), X_WS.end());
  }
}

std::vector<uint32_t> RobotModel::PairsWithout(const std::set<LinkPair>& left_out) const {
  std::vector<uint32_t> pairs;
  for (uint32_t a = 0; a < parts.size(); ++a) {
    for (uint32_t b = a + 1; b < parts.size(); ++b) {
      if (parts[a].link == parts[b].link) continue;
      if (left_out.contains(MakeLinkPair(parts[a].link, parts[b].link))) continue;
      pairs.insert(pairs.end(), {a, b});
    }
  }
  return pairs;
}

absl::StatusOr<RobotModel> ReadRobot(const RobotArguments& arguments) {
  auto robot = ReadUrdf(arguments.urdf);
  if (!robot.ok()) return robot.status();
  const auto paths = PathsOf(arguments);
  if (!paths.ok()) return paths.status();
  RobotModel model;
  model.robot = *std::move(robot);
  for (size_t link = 0; link < model.robot.links.size(); ++link) {
    const RobotLink& from = model.robot.links[link];
    for (size_t i = 0; i < from.shapes.size(); ++i) {
      const CollisionShape& shape = from.shapes[i];
      auto hull = HullOf(shape, *paths);
      if (!hull.ok()) {
        const std::string message(hull.status().message().data(), hull.status().message().size());
        return absl::Status(hull.status().code(),
                            absl::StrCat(arguments.urdf, ":", shape.line, ": link ",
                                         Quoted(from.name), ": ", message));
      }
      RobotPart& part = model.parts.emplace_back();
      part.link = static_cast<int>(link);
      part.name = from.shapes.size() == 1 ? from.name : absl::StrCat(from.name, "/", i + 1);
      part.X_LS = shape.X_LS;
      part.kind = shape.kind;
      part.hull = *std::move(hull);
    }
  }
  if (model.parts.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(arguments.urdf, ": no link has a <collision>; nothing can collide"));
  }
  return model;
}

absl::Status RegisterHulls(const RobotArguments& arguments, const Client& client,
                           TemporaryHulls* temporary, RobotModel* model) {
  std::set<std::string> taken;
  for (RobotPart& part : model->parts) {
    const std::string segment = UniqueHullSegment(part.name, &taken);
    const auto feed = [&part](const Client::PointSink& sink) {
      return SendInMessages(part.hull.xyz, sink);
    };
    if (arguments.prefix.empty()) {
      auto id = temporary->Add(segment, feed);
      if (!id.ok()) return id.status();
      part.hull_id = *std::move(id);
    } else {
      v1::ReplaceOpen open;
      open.set_hull_id(arguments.prefix + segment);
      open.set_create_if_absent(true);
      if (const auto replaced = client.ReplaceHull(open, feed); !replaced.ok()) {
        return replaced.status();
      }
      part.hull_id = open.hull_id();
    }
  }
  return absl::OkStatus();
}

}  // namespace hulld
