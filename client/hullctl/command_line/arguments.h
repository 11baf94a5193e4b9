#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_ARGUMENTS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_ARGUMENTS_H_

#include <absl/status/statusor.h>

#include <array>
#include <chrono>
#include <string>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/geometry.pb.h"

namespace hulld {

// Parses "30s", "500ms", "2m"; a plain number is seconds. Positive, at most a day.
absl::StatusOr<std::chrono::milliseconds> ParseDuration(const std::string& text);

// Parses "x,y,z".
absl::StatusOr<std::array<double, 3>> ParseTriple(const std::string& text);

// Parses "w,x,y,z,tx,ty,tz", or "tx,ty,tz" for a pose without rotation. Each number becomes the
// nearest double.
absl::StatusOr<v1::Pose> ParsePose(const std::string& text);

// Moves a placement to `end`, on the shorter of the two paths between the rotations. Without a
// rotation, `end` keeps that of the start.
void SetMotion(const v1::Pose& end, v1::Placement* placement);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_ARGUMENTS_H_
