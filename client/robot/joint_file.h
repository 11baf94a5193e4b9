#ifndef HULLD_CLIENT_ROBOT_JOINT_FILE_H_
#define HULLD_CLIENT_ROBOT_JOINT_FILE_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/robot/robot.h"

namespace hulld {

// Reads waypoints one by one from a table: a header of names of joints, then a row for each
// waypoint, in radians and metres, with commas, semicolons, tabs or spaces between. A column
// "time" is passed over, blank lines and lines that start with # are, too. Joints without a column
// stay at rest. Memory does not grow with the file.
class WaypointReader {
 public:
  // Reads the header. INVALID_ARGUMENT names the line: a name that is no joint of the robot, one of
  // a joint that is fixed or mimics another, a joint that is named twice, no joint at all.
  static absl::StatusOr<WaypointReader> Open(ByteSource* source, const Robot& robot);

  // Replaces `free_values`, one for each free joint of the robot, by the next waypoint. False at
  // the end. INVALID_ARGUMENT names the line: too few or too many columns, no finite number.
  absl::StatusOr<bool> Next(std::vector<double>* free_values);

  // Where the last waypoint was.
  uint64_t line() const { return source_->line(); }

 private:
  explicit WaypointReader(ByteSource* source) : source_(source) {}

  ByteSource* source_;
  // For each column, the place among the free joints; -1 for one that is passed over.
  std::vector<int> columns_;
  std::vector<double> rest_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_JOINT_FILE_H_
