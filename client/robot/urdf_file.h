#ifndef HULLD_CLIENT_ROBOT_URDF_FILE_H_
#define HULLD_CLIENT_ROBOT_URDF_FILE_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/robot/robot.h"

namespace hulld {

// Reads links, joints and what collides from a robot description; - is standard input. What is only
// looked at or weighed (visual, inertial, transmissions, simulators) is passed over. liburdfdom
// reads the values. Capsules, which its version 3 does not know, are read here.
//
// INVALID_ARGUMENT names file and line, and says what the element lacks: XML that is not
// well-formed, a number that is none, a link or joint without a name or with one that is taken, a
// shape without a size above 0, links that form no tree, a joint that mimics itself, and kinds of
// joints that are not posed here (floating, planar).
absl::StatusOr<Robot> ReadUrdf(const std::string& path);
absl::StatusOr<Robot> ParseUrdf(const std::string& text, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_URDF_FILE_H_
