#include "client/hullctl/robot/waypoint_source.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/help/suggestion.h"
#include "client/packed_placements.h"

namespace hulld {
namespace {

// Sets a variable to a number, or all variables of a joint: a floating joint from a pose, a planar
// one from x,y,theta.
absl::Status SetJoint(const Robot& robot, const std::string& name, const std::string& text,
                      const std::vector<JointVariable>& variables, std::vector<double>* values) {
  std::vector<std::string> known;
  for (size_t i = 0; i < variables.size(); ++i) {
    known.push_back(variables[i].name);
    if (variables[i].name != name) continue;
    double* const value = &(*values)[i];
    if (ParseDouble(text, value) == NumberText::kNumber && std::isfinite(*value)) {
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError(absl::StrCat(Quoted(text), " is not a value of joint ",
                                                   Quoted(name), "; pass a number, as in ", name,
                                                   "=0.5"));
  }
  const int joint = robot.FindJoint(name);
  const RobotJoint* const loose = joint >= 0 && robot.joints[static_cast<size_t>(joint)].is_loose()
                                      ? &robot.joints[static_cast<size_t>(joint)]
                                      : nullptr;
  if (loose == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(Quoted(name), " is not a joint of ", robot.name,
                                                   " that can be set", Suggestion(name, known)));
  }
  JointValue value = {};
  if (loose->kind == JointKind::kFloating) {
    HULLD_ASSIGN_OR_RETURN(const auto pose, ParsePose(text));
    value = NumbersOf(pose);
  } else {
    HULLD_ASSIGN_OR_RETURN(const auto triple, ParseTriple(text));
    std::copy(triple.begin(), triple.end(), value.begin());
  }
  for (size_t i = 0; i < variables.size(); ++i) {
    if (variables[i].joint == joint) (*values)[i] = value[variables[i].place];
  }
  return absl::OkStatus();
}

}  // namespace

// Returns the rest values, overridden by those given.
absl::StatusOr<Waypoint> WaypointSource::GivenValues() const {
  Waypoint values = RestValues(robot_);
  const std::vector<JointVariable> variables = robot_.Variables();
  for (const std::string& given : joint_values_) {
    const size_t equals = given.find('=');
    const std::string name = given.substr(0, equals);
    const std::string text = equals == std::string::npos ? "" : given.substr(equals + 1);
    const auto set = SetJoint(robot_, name, text, variables, &values);
    if (!set.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("--joint: ", set.message()));
    }
  }
  const std::string joint = JointWithoutRotation(robot_, values);
  if (!joint.empty()) {
    return absl::InvalidArgumentError(absl::StrCat("--joint: the quaternion of ", Quoted(joint),
                                                   " is zero; use 1,0,0,0 for no rotation"));
  }
  return values;
}

absl::Status WaypointSource::Open(const std::string& file) {
  if (!file.empty()) {
    HULLD_ASSIGN_OR_RETURN(source_, ByteSource::Open(file));
    HULLD_ASSIGN_OR_RETURN(reader_, WaypointReader::Open(source_.get(), robot_));
  }
  Waypoint values;
  while (pending_.size() < 2) {
    HULLD_ASSIGN_OR_RETURN(const auto more, Read(&values));
    if (!more) break;
    pending_.push_back(values);
  }
  has_many_ = pending_.size() > 1;
  if (!pending_.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(source_->name(), ": contains no waypoints"));
}

absl::StatusOr<bool> WaypointSource::Read(Waypoint* free_values) {
  if (reader_.has_value()) {
    auto more = reader_->Next(free_values);
    if (more.ok() && *more) lines_.push_back(reader_->line());
    return more;
  }
  if (given_was_read_) return false;
  given_was_read_ = true;
  HULLD_ASSIGN_OR_RETURN(auto given, GivenValues());
  *free_values = std::move(given);
  return true;
}

absl::StatusOr<bool> WaypointSource::Next(Waypoint* free_values) {
  if (pending_.empty()) return Read(free_values);
  *free_values = std::move(pending_.front());
  pending_.pop_front();
  return true;
}

std::string WaypointSource::LineOf(uint64_t waypoint) const {
  if (waypoint >= lines_.size()) return "";
  return absl::StrCat(source_->name(), ":", lines_[waypoint]);
}

std::string WaypointSource::PlaceOf(uint64_t waypoint) const {
  const std::string line = LineOf(waypoint);
  return absl::StrCat("waypoint ", waypoint + 1, line.empty() ? "" : " (", line,
                      line.empty() ? "" : ")");
}

}  // namespace hulld
