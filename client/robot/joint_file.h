#ifndef HULLD_CLIENT_ROBOT_JOINT_FILE_H_
#define HULLD_CLIENT_ROBOT_JOINT_FILE_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <string_view>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/robot/robot.h"

namespace hulld {

// Returns the cells of a line of a table, without quotes and spaces; separated by the first comma,
// semicolon, or tab, otherwise by spaces. Empty for a blank line or a comment (#).
std::vector<std::string_view> CellsOf(std::string_view line);

// Reads waypoints one by one from a table: a header of variable names (see JointVariable), then one
// row per waypoint, in radians and meters, separated by commas, semicolons, tabs, or spaces. Skips
// a column named "time", blank lines, and lines that start with #. Variables without a column stay
// at rest. Memory does not grow with the file.
class WaypointReader {
 public:
  // Reads the header. INVALID_ARGUMENT names the line: an unknown joint, a joint that is fixed or
  // mimics another, a duplicate joint, an incomplete quaternion, or no joint at all. The robot must
  // outlive the reader.
  static absl::StatusOr<WaypointReader> Open(ByteSource* source, const Robot& robot);

  // Sets `free_values`, one number per variable of the robot, to the next waypoint. Returns false
  // at the end. INVALID_ARGUMENT names the line: too few or too many columns, a number that is not
  // finite, or a quaternion of 0.
  absl::StatusOr<bool> Next(std::vector<double>* free_values);

  // Returns the line of the last waypoint.
  uint64_t line() const { return source_->line(); }

 private:
  WaypointReader(ByteSource* source, const Robot& robot) : source_(source), robot_(&robot) {}

  ByteSource* source_;
  const Robot* robot_;
  // The index of the variable of each column; -1 for a skipped column.
  std::vector<int> columns_;
  std::vector<double> rest_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_JOINT_FILE_H_
