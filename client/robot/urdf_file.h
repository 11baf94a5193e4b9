#ifndef HULLD_CLIENT_ROBOT_URDF_FILE_H_
#define HULLD_CLIENT_ROBOT_URDF_FILE_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/robot/robot.h"

namespace hulld {

// Reads links, joints, and collision shapes from a robot description; "-" is standard input.
// Ignores other elements (visual, inertial, transmissions, simulators). Rotations are rpy, or
// quat_xyzw as in URDF 1.1.
//
// INVALID_ARGUMENT names file and line, and the defect of the element: malformed XML, an invalid
// number, an unknown attribute of <origin>, a link or joint without a name or with a duplicate
// name, several shapes in one <geometry>, a repeated element, a shape without a size or with a
// negative one, a mesh scaled by 0, links that do not form a tree, a joint that mimics itself or a
// joint of several values, or a planar joint without an axis.
absl::StatusOr<Robot> ReadUrdf(const std::string& path);
absl::StatusOr<Robot> ParseUrdf(const std::string& text, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_URDF_FILE_H_
