#include "client/hullctl/robot/robot_scene.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>
#include <set>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/byte_source.h"
#include "client/hullctl/body/hull_segment.h"
#include "client/hullctl/robot/check_scope.h"
#include "client/hullctl/view/answer_feed.h"
#include "client/point_messages.h"
#include "client/robot/joint_file.h"
#include "client/robot/robot.h"
#include "client/robot/srdf_file.h"

namespace hulld {
namespace {

// Range of the slider of an unlimited joint in meters. Not tuned.
constexpr double kReach = 2;

// Returns the range of a variable without regard to the waypoints.
std::array<double, 2> RangeOf(const RobotJoint& joint, const JointVariable& variable) {
  if (joint.limits) return *joint.limits;
  // The numbers of a floating joint are a quaternion and a translation, in this order.
  const bool is_quaternion = joint.kind == JointKind::kFloating && variable.place < 4;
  const bool is_angle = joint.kind == JointKind::kContinuous ||
                        joint.kind == JointKind::kRevolute ||
                        (joint.kind == JointKind::kPlanar && variable.place == 2);
  const double reach = is_quaternion ? 1 : is_angle ? std::numbers::pi : kReach;
  return {-reach, reach};
}

absl::StatusOr<std::vector<std::vector<double>>> ReadWaypoints(const std::string& path,
                                                               const Robot& robot) {
  std::vector<std::vector<double>> waypoints;
  HULLD_ASSIGN_OR_RETURN(const auto source, ByteSource::Open(path));
  HULLD_ASSIGN_OR_RETURN(auto reader, WaypointReader::Open(source.get(), robot));
  std::vector<double> values;
  while (true) {
    HULLD_ASSIGN_OR_RETURN(const auto more, reader.Next(&values));
    if (!more) break;
    if (waypoints.size() == kMaxShownWaypoints) {
      return absl::InvalidArgumentError(
          absl::StrCat(path, ":", reader.line(), ": the viewer shows up to ", kMaxShownWaypoints,
                       " waypoints; remove the rest"));
    }
    waypoints.push_back(values);
  }
  if (!waypoints.empty()) return waypoints;
  return absl::InvalidArgumentError(absl::StrCat(path, ": contains no waypoints"));
}

std::vector<RigidPose> PosesAt(const RobotModel& model, const std::vector<double>& values) {
  const std::vector<RigidPose> X_WL =
      LinkPoses(model.robot, kNoMotion, AllJointValues(model.robot, values));
  std::vector<RigidPose> poses;
  for (const RobotPart& part : model.parts) {
    poses.push_back(Compose(X_WL[static_cast<size_t>(part.link)], part.X_LS));
  }
  return poses;
}

// Sets the joints of the scene to the first waypoint, or to rest.
void AddJoints(const std::shared_ptr<const RobotModel>& model, ViewJoints* joints) {
  const std::vector<double> start =
      joints->waypoints.empty() ? RestValues(model->robot) : joints->waypoints.front();
  const std::vector<JointVariable> variables = model->robot.Variables();
  for (size_t i = 0; i < variables.size(); ++i) {
    auto [low, high] =
        RangeOf(model->robot.joints[static_cast<size_t>(variables[i].joint)], variables[i]);
    for (const std::vector<double>& waypoint : joints->waypoints) {
      low = std::min(low, waypoint[i]);
      high = std::max(high, waypoint[i]);
    }
    joints->joints.push_back({variables[i].name, low, high, start[i]});
  }
  joints->poses =
      [model](const std::vector<double>& values) -> absl::StatusOr<std::vector<RigidPose>> {
    const std::string joint = JointWithoutRotation(model->robot, values);
    if (joint.empty()) return PosesAt(*model, values);
    return absl::InvalidArgumentError(
        absl::StrCat("The quaternion of ", joint, " is zero; use 1, 0, 0, 0 for no rotation."));
  };
}

// Adds an object for each part, with the surface of its mesh, if any.
void AddParts(RobotModel* model, ViewScene* scene) {
  for (RobotPart& part : model->parts) {
    ViewObject& object = scene->objects.emplace_back();
    object.name = part.name;
    if (part.mesh.triangles.empty()) continue;
    object.file = static_cast<int>(scene->files.size());
    auto shape = std::make_shared<FileShape>();
    shape->name = part.name;
    SetMesh(part.mesh, shape.get());
    scene->files.push_back(std::move(shape));
  }
}

// Places the hulls of the parts at the start of the joints. Requires the IDs of the parts.
void PlaceParts(const RobotModel& model, ViewScene* scene) {
  std::vector<double> start;
  for (const ViewJoints::Joint& joint : scene->joints.joints) start.push_back(joint.value);
  const std::vector<RigidPose> poses = PosesAt(model, start);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    ViewObject& object = scene->objects[i];
    object.hull_id = model.parts[i].hull_id;
    object.pose = poses[i];
    object.radius = model.parts[i].hull.radius;
    object.is_jointed = true;
  }
}

// Appends the placements of a scene file, which are at rest.
absl::Status AddSurroundings(const std::string& path, ViewScene* scene) {
  ViewScene around;
  HULLD_RETURN_IF_ERROR(AddSceneFile(path, &around));
  const int files = static_cast<int>(scene->files.size());
  for (ViewObject& object : around.objects) {
    if (object.motion) {
      return absl::InvalidArgumentError(absl::StrCat(
          path, ": ", object.name,
          " moves, but the surroundings of a robot must be at rest; remove its \"to\""));
    }
    if (object.file >= 0) object.file += files;
    scene->objects.push_back(std::move(object));
  }
  scene->files.insert(scene->files.end(), around.files.begin(), around.files.end());
  return absl::OkStatus();
}

// Lists the pairs of 'hullctl robot check': pairs of parts of different links, except for links in
// `left_out`, and pairs of a part and a placement of the surroundings.
absl::Status NamePairs(const RobotModel& model, const std::set<LinkPair>& left_out,
                       const std::vector<std::string>& ignored, ViewScene* scene) {
  std::vector<uint32_t> pairs = model.PairsWithout(left_out);
  const auto parts = static_cast<uint32_t>(model.parts.size());
  for (uint32_t a = 0; a < parts; ++a) {
    for (uint32_t b = parts; b < scene->objects.size(); ++b) pairs.insert(pairs.end(), {a, b});
  }
  std::vector<std::string> names;
  for (const ViewObject& object : scene->objects) names.push_back(object.name);
  const absl::Status removed = RemoveIgnored(ignored, model, names, &pairs);
  scene->pairs = std::move(pairs);
  return removed;
}

// Creates the hulls of the parts on the server, and sets their IDs.
absl::Status RegisterParts(TemporaryHulls* temporary, RobotModel* model) {
  std::set<std::string> taken;
  for (RobotPart& part : model->parts) {
    HULLD_ASSIGN_OR_RETURN(auto id, temporary->Add(UniqueHullSegment(part.name, &taken),
                                                   [&part](const Client::PointSink& sink) {
                                                     return SendInMessages(part.hull.xyz, sink);
                                                   }));
    part.hull_id = std::move(id);
    part.mesh = {};
  }
  return absl::OkStatus();
}

// Queries every waypoint.
absl::Status FindContacts(const Client& client, ViewScene* scene) {
  std::vector<ViewObject> objects = scene->objects;
  for (uint32_t i = 0; i < scene->joints.waypoints.size(); ++i) {
    HULLD_ASSIGN_OR_RETURN(const auto poses, scene->joints.poses(scene->joints.waypoints[i]));
    for (size_t part = 0; part < poses.size(); ++part) objects[part].pose = poses[part];
    HULLD_ASSIGN_OR_RETURN(const auto collides,
                           AnyCollides(client, scene->rules, scene->pairs, objects));
    if (collides) scene->joints.contacts.push_back(i);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status AddRobot(const RobotSceneArguments& arguments, const Client& client,
                      TemporaryHulls* temporary, ViewScene* scene) {
  HULLD_ASSIGN_OR_RETURN(auto model, ReadRobot(arguments.robot));
  HULLD_ASSIGN_OR_RETURN(const std::set<LinkPair> left_out,
                         arguments.srdf.empty() ? AdjacentPairs(model.robot)
                                                : ReadDisabledPairs(arguments.srdf, model.robot));
  if (!arguments.joints.empty()) {
    HULLD_ASSIGN_OR_RETURN(scene->joints.waypoints, ReadWaypoints(arguments.joints, model.robot));
  }
  AddParts(&model, scene);
  HULLD_RETURN_IF_ERROR(RegisterParts(temporary, &model));
  const auto shared = std::make_shared<const RobotModel>(std::move(model));
  AddJoints(shared, &scene->joints);
  PlaceParts(*shared, scene);
  absl::Status added =
      arguments.scene.empty() ? absl::OkStatus() : AddSurroundings(arguments.scene, scene);
  if (added.ok()) added = NamePairs(*shared, left_out, arguments.ignored, scene);
  return added.ok() ? FindContacts(client, scene) : added;
}

}  // namespace hulld
