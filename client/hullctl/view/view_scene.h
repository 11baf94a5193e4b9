#ifndef HULLD_CLIENT_HULLCTL_VIEW_VIEW_SCENE_H_
#define HULLD_CLIENT_HULLCTL_VIEW_VIEW_SCENE_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/formats/mesh_file.h"
#include "client/pose/rigid_pose.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// The shape of a file: a mesh, or points alone.
struct FileShape {
  std::string name;
  // n x 3. At most kMaxDrawnPoints of the points of a file without triangles.
  std::vector<double> xyz;
  // Three indices each.
  std::vector<uint32_t> triangles;
  uint64_t point_count = 0;
  // The hull of the file, if no server has it, and its name, which is a path rather than an ID.
  std::shared_ptr<const HullMesh> hull;
  std::string hull_name;
};
inline constexpr uint64_t kMaxDrawnPoints = 2'000'000;

// A motion over the time t in [0, 1], as of a Placement with an end pose.
struct ViewMotion {
  RigidPose start = kNoMotion;
  RigidPose end = kNoMotion;
};

// Returns the pose at time t, rounded: each number is (1 - t) start + t end, as in page/pose.js.
RigidPose PoseAt(const ViewMotion& motion, double t);

// A displayed object: a hull or a body at a pose, a file, or a file with its hull.
struct ViewObject {
  std::string name;
  // ID of a hull or a body, or FileShape::hull_name. Empty: none.
  std::string hull_id;
  // Index into ViewScene::files, -1: none.
  int file = -1;
  RigidPose pose = kNoMotion;
  // Placement.radius.
  double radius = 0;
  // FileShape::hull of its file; null for an ID.
  std::shared_ptr<const HullMesh> hull = nullptr;
  // Moved by the joints of the scene only.
  bool is_jointed = false;
  // Moved by the time of the scene only; `pose` is its pose at that time.
  std::optional<ViewMotion> motion = std::nullopt;
};

// Joints that move objects of a scene, and a trajectory of them.
struct ViewJoints {
  struct Joint {
    std::string name;
    // Range of its slider; contains the values of all waypoints.
    double low = 0;
    double high = 0;
    double value = 0;
  };
  std::vector<Joint> joints;
  // Returns the poses of the jointed objects, in order, for a finite value of each joint.
  // INVALID_ARGUMENT: the values are not a configuration.
  std::function<absl::StatusOr<std::vector<RigidPose>>(const std::vector<double>& values)> poses;
  // Values of the joints at each waypoint.
  std::vector<std::vector<double>> waypoints;
  // Waypoints with a colliding pair, ascending.
  std::vector<uint32_t> contacts;
};

struct ViewScene {
  // Key that selects the scene.
  std::string key;
  std::string title;
  std::string note;
  std::vector<ViewObject> objects;
  std::vector<std::shared_ptr<const FileShape>> files;
  // Hulls and bodies that appear under these prefixes become objects, too.
  std::vector<std::string> prefixes;
  // Hulls under the prefixes that are shown only as pieces of bodies.
  std::vector<std::string> pieces;
  // Selection of the queried pairs, unless `pairs` names them: groups and movers of a scene file.
  // Without placements.
  v1::FindCollisionsRequest rules;
  // The queried pairs, two indices of objects each, if a scene file or a robot names them. Requires
  // that every object has a hull.
  std::optional<std::vector<uint32_t>> pairs;
  // Empty unless the scene is a robot.
  ViewJoints joints;
  // RecordedWatch::messages of a recorded watch of these objects; empty if there is none.
  std::vector<std::string> watch;
};

// Reads a mesh (IsMeshFormat) or the points of any other format. Skips points that are not finite.
// INVALID_ARGUMENT names the file and the position.
absl::StatusOr<FileShape> ReadShape(const std::string& path);

// Sets the vertices and triangles of a shape.
void SetMesh(const TriangleMesh& mesh, FileShape* shape);

// Returns the name of a file without its folders. Bytes that are not UTF-8 become question marks,
// as they would end the connection to the page.
std::string ShownName(const std::string& path);

// Returns true if the argument names an existing file, rather than a hull or a body.
bool IsFile(const std::string& argument);

// Adds the hull or the body of this ID to the scene, or all with this ID prefix, except for hulls
// that are pieces of these bodies. NOT_FOUND: none exists.
absl::Status AddHullsAndBodies(const Client& client, const std::string& id_or_prefix,
                               ViewScene* scene);

// Returns true if a file contains a scene rather than points or a mesh: by its extension, or, if
// that is of plain text or of no known format, by its first line.
bool IsSceneFile(const std::string& path);

// Adds the placements of a scene file (`hullctl scene --help`). INVALID_ARGUMENT names the
// position. Errors of the server that builds the hulls of inline shapes.
absl::Status AddSceneFile(const std::string& path, ViewScene* scene);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_VIEW_SCENE_H_
