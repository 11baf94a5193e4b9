#ifndef HULLD_CLIENT_HULLCTL_ROBOT_WAYPOINT_SOURCE_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_WAYPOINT_SOURCE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/robot/joint_file.h"
#include "client/robot/robot.h"

namespace hulld {

// Values of the free variables of a robot (Robot::Variables).
using Waypoint = std::vector<double>;

// The waypoints of a file of joint values or, without a file, one from --joint.
class WaypointSource {
 public:
  // joint_values: entries NAME=VALUE; other variables have their rest values. Both must outlive
  // the source.
  WaypointSource(const Robot& robot, const std::vector<std::string>& joint_values)
      : robot_(robot), joint_values_(joint_values) {}

  // Must be called first. INVALID_ARGUMENT: a value or the file is malformed, or the file has no
  // waypoint.
  absl::Status Open(const std::string& file);
  // Returns false at the end.
  absl::StatusOr<bool> Next(Waypoint* free_values);
  bool has_many() const { return has_many_; }

  // FILE:LINE of a waypoint that was read, from 0; empty without a file.
  std::string LineOf(uint64_t waypoint) const;
  // For messages: its number from 1, and its line.
  std::string PlaceOf(uint64_t waypoint) const;

 private:
  absl::StatusOr<Waypoint> GivenValues() const;
  absl::StatusOr<bool> Read(Waypoint* free_values);

  const Robot& robot_;
  const std::vector<std::string>& joint_values_;
  std::unique_ptr<ByteSource> source_;
  std::optional<WaypointReader> reader_;
  bool given_was_read_ = false;
  // The first waypoints, which show whether there is more than one.
  std::deque<Waypoint> pending_;
  bool has_many_ = false;
  // Lines of the waypoints read from the file.
  std::vector<uint64_t> lines_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_WAYPOINT_SOURCE_H_
