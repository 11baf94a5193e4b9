#ifndef HULLD_CLIENT_HULLCTL_ROBOT_WAYPOINT_STREAM_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_WAYPOINT_STREAM_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "client/client.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/robot/check_scope.h"

namespace hulld {

// Queries the same pairs at a sequence of waypoints in one stream. One message carries several
// waypoints, each on a lane of its own with all parts, so that they share a round trip and the
// server processes them in parallel. A lane's pairs start from the feature that decided them at its
// previous waypoint.
class WaypointStream {
 public:
  // Receives an answer: the pair's index in the scope, and its row. `problem` is the reason for a
  // missing answer; empty otherwise.
  using Receiver = std::function<void(uint64_t waypoint, size_t pair, const AnswerRow& row,
                                      const std::string& problem)>;

  WaypointStream(const Client& client, CheckScope scope, v1::Wanted wanted, double tolerance,
                 Receiver receive);

  // Returns the number of waypoints per message.
  size_t lanes() const { return lanes_; }

  // Queries `count` waypoints, at most lanes(). poses: of all parts, seven numbers each,
  // waypoint after waypoint. Answers are ordered by waypoint, then by pair. INTERNAL: more
  // waypoints than in the first call.
  absl::Status Query(size_t count, const std::vector<double>& poses);

  absl::Status Close();

 private:
  absl::StatusOr<v1::StreamCollisionsResponse> Open(size_t count, const std::vector<double>& poses);
  absl::StatusOr<v1::StreamCollisionsResponse> Update(size_t count,
                                                      const std::vector<double>& poses);
  absl::Status Take(const v1::StreamCollisionsResponse& answer, size_t count);
  // Returns the index of an object's placement on a lane, given the number of lanes. The fixed
  // objects follow all parts.
  uint32_t PlacementOf(uint32_t lane, uint32_t object, size_t lanes) const;
  std::string ProblemOf(uint32_t lane, size_t pair) const;

  const Client& client_;
  const CheckScope scope_;
  const v1::Wanted wanted_;
  const double tolerance_;
  const Receiver receive_;
  size_t lanes_;
  std::unique_ptr<CollisionStream> stream_;
  // Lanes of the open stream.
  size_t open_lanes_ = 0;
  uint64_t waypoints_ = 0;
  std::unordered_map<uint32_t, std::string> placement_problems_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_WAYPOINT_STREAM_H_
