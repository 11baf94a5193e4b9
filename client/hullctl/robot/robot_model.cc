#include "client/hullctl/robot/robot_model.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <array>
#include <cstdlib>
#include <optional>
#include <utility>

#include "client/base/status_macros.h"
#include "client/enclosure/mesh_volume.h"
#include "client/formats/text_number.h"
#include "client/hullctl/body/hull_segment.h"
#include "client/hullctl/local/file_shape.h"
#include "client/hullctl/local/local_server.h"
#include "client/hullctl/parts/volume_comparison.h"
#include "client/point_messages.h"
#include "client/robot/package_path.h"
#include "client/robot/urdf_file.h"

namespace hulld {

const char kRobotHelp[] =
    "FILE is a robot description (URDF). Each collision shape becomes a hull in its own frame. A\n"
    "mesh becomes its convex hull, a cylinder an enclosing polyhedron; the distance by which it\n"
    "exceeds the cylinder is printed. Spheres and capsules are exact: a center or a segment with\n"
    "a radius. A mesh file of several named parts that are all convex, as V-HACD and CoACD write\n"
    "them, becomes one hull per part; --split does this with any parts. Queries carry the hulls;\n"
    "none is stored on the server unless --prefix is given, which stores them without radii. A\n"
    "hull of more than 4096 vertices needs --prefix or --local. Meshes are obj, stl, ply, off,\n"
    "gltf, or dae. A package://NAME/ is found through --package, ROS_PACKAGE_PATH, and\n"
    "AMENT_PREFIX_PATH, and in the folders above FILE. Units are meters and radians, as in URDF.\n"
    "Poses are computed in floating point; answers are exact for these poses.\n";

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

absl::StatusOr<std::vector<MeshPiece>> ShapePieces(const CollisionShape& shape,
                                                   const PackagePaths& paths, MeshSplit split) {
  if (shape.kind != ShapeKind::kMesh) return std::vector<MeshPiece>{{PrimitiveHull(shape), {}}};
  HULLD_ASSIGN_OR_RETURN(const auto file, ResolveFile(paths, shape.mesh));
  return MeshPieces(shape, file, split);
}

// Adds the parts of a link to the model.
absl::Status AddLink(const RobotArguments& arguments, const PackagePaths& paths, size_t link,
                     RobotModel* model) {
  const RobotLink& from = model->robot.links[link];
  const size_t first = model->parts.size();
  for (const CollisionShape& shape : from.shapes) {
    auto pieces = ShapePieces(shape, paths, arguments.split);
    if (!pieces.ok()) {
      const std::string message(pieces.status().message());
      return absl::Status(pieces.status().code(),
                          absl::StrCat(arguments.urdf, ":", shape.line, ": link ",
                                       Quoted(from.name), ": ", message));
    }
    if (pieces->size() > 1) {
      model->notes.push_back(
          absl::StrCat(from.name, ": ", pieces->size(), " pieces of ", shape.mesh));
    }
    for (MeshPiece& piece : *pieces) {
      RobotPart& part = model->parts.emplace_back();
      part.link = static_cast<int>(link);
      part.name = from.name;
      part.X_LS = shape.X_LS;
      part.hull = std::move(piece.hull);
      part.mesh = std::move(piece.mesh);
    }
  }
  const size_t count = model->parts.size() - first;
  for (size_t i = 0; count > 1 && i < count; ++i) {
    absl::StrAppend(&model->parts[first + i].name, "/", i + 1);
  }
  return absl::OkStatus();
}

// Warns if the hull of a part is so much larger than its mesh that it is a poor fit.
void WarnOfSwollenPart(const Invocation& run, const RobotPart& part, const HullMesh& hull) {
  const std::optional<double> ratio = VolumeRatio(hull, part.mesh);
  if (ratio.value_or(1) < kVolumeRatioToWarn) return;
  run.err << "hullctl: warning: the hull of " << part.name << " has "
          << absl::StrFormat("%.4g", *ratio)
          << " times the volume of its mesh and may collide where the mesh does not; use a convex "
             "decomposition of the mesh, or --split\n";
}

// Drops repeated points, which are frequent in a list of triangles.
void KeepDistinctPoints(std::vector<double>* xyz) {
  std::set<std::array<double, 3>> known;
  size_t kept = 0;
  for (size_t i = 0; i < xyz->size(); i += 3) {
    if (!known.insert({(*xyz)[i], (*xyz)[i + 1], (*xyz)[i + 2]}).second) continue;
    for (size_t axis = 0; axis < 3; ++axis) (*xyz)[kept++] = (*xyz)[i + axis];
  }
  xyz->resize(kept);
}

// Turns the hull of a mesh into an inline shape.
absl::Status ReduceToVertices(const Invocation& run, LocalHullBuilder* builder, RobotPart* part) {
  KeepDistinctPoints(&part->hull.xyz);
  const bool is_small = part->hull.xyz.size() <= 3 * kMaxShapePoints;
  if (is_small && part->mesh.triangles.empty()) return absl::OkStatus();
  const auto hull = builder->Build(
      [part](const Client::PointSink& sink) { return SendInMessages(part->hull.xyz, sink); });
  if (!hull.ok()) {
    if (is_small) return absl::OkStatus();
    return absl::Status(hull.status().code(),
                        absl::StrCat(part->name, " has more than ", kMaxShapePoints,
                                     " points, and the local server that would reduce them to its "
                                     "hull failed; pass --prefix to register the hulls instead: ",
                                     hull.status().message()));
  }
  if (hull->vertex_count() > kMaxShapePoints) {
    return absl::InvalidArgumentError(
        absl::StrCat(part->name, ": its hull has ", hull->vertex_count(),
                     " vertices, but a query can carry at most ", kMaxShapePoints,
                     "; use --local, or register the hulls with --prefix"));
  }
  WarnOfSwollenPart(run, *part, *hull);
  part->hull.xyz = hull->xyz;
  return absl::OkStatus();
}

}  // namespace

void AddRobotArguments(Command command, RobotArguments* arguments) {
  command.AddText("FILE", &arguments->urdf, "Robot description (URDF); - is standard input")
      .Required();
  command.AddRepeated("--package", &arguments->packages, "Folder of a package; repeatable")
      .ValueName("NAME=DIR");
  command
      .AddChoice("--split",
                 {{"names", MeshSplit::kNames},
                  {"components", MeshSplit::kComponents},
                  {"none", MeshSplit::kNone}},
                 &arguments->split,
                 "Split meshes into parts: by names in the file, or by connected components; none: "
                 "one hull per mesh (default: by names, if all parts are convex)")
      .ValueName("HOW");
  command
      .AddText("--prefix", &arguments->prefix,
               "Keep the hulls of the links under this prefix, such as arm/ (default: store none)")
      .ValueName("PREFIX");
}

void RobotModel::AppendPoses(const RigidPose& X_WB, std::span<const JointValue> joint_values,
                             std::vector<double>* poses) const {
  const std::vector<RigidPose> X_WL = LinkPoses(robot, X_WB, joint_values);
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
  HULLD_ASSIGN_OR_RETURN(auto robot, ReadUrdf(arguments.urdf));
  HULLD_ASSIGN_OR_RETURN(const auto paths, PathsOf(arguments));
  RobotModel model;
  model.robot = std::move(robot);
  for (size_t link = 0; link < model.robot.links.size(); ++link) {
    HULLD_RETURN_IF_ERROR(AddLink(arguments, paths, link, &model));
  }
  if (model.parts.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        arguments.urdf, ": no link has a <collision> element, so nothing can collide"));
  }
  return model;
}

absl::Status PrepareHulls(const Invocation& run, const RobotArguments& arguments,
                          const Client& client, RobotModel* model) {
  const bool registers = run.local || !arguments.prefix.empty();
  LocalHullBuilder builder;
  std::set<std::string> taken;
  for (RobotPart& part : model->parts) {
    if (registers) {
      part.hull_id = arguments.prefix + UniqueHullSegment(part.name, &taken);
      HULLD_RETURN_IF_ERROR(client.PutHull(part.hull_id, part.hull.xyz));
      // Failure to read the hull does not fail the check; the mesh is only compared.
      const auto hull = part.mesh.triangles.empty() ? HullMesh() : client.GetHullMesh(part.hull_id);
      if (hull.ok()) WarnOfSwollenPart(run, part, *hull);
    } else {
      HULLD_RETURN_IF_ERROR(ReduceToVertices(run, &builder, &part));
    }
    part.mesh = {};
  }
  return absl::OkStatus();
}

}  // namespace hulld
