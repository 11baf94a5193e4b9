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

namespace hulld {

// Asks about the same pairs at one waypoint after another, in one stream. Several waypoints go in
// one message, each on a lane of its own with all parts, so that a round trip is paid once for all
// of them and the server works on them in parallel; a lane's pairs start from what decided them at
// its waypoint before.
class WaypointStream {
 public:
  struct Scope {
    // The hulls of the parts that move, and those that stand still, with their poses (seven numbers
    // each).
    std::vector<std::string> moving;
    std::vector<std::string> fixed;
    std::vector<double> fixed_poses;
    // Two indices each: into `moving`, then those of `fixed` counted on.
    std::vector<uint32_t> pairs;
    v1::Wanted wanted;
    double tolerance = 0;
  };

  // An answer: the pair's index among those of the scope, and its row. `problem` says why it has
  // none; it is empty for an answer.
  using Receiver = std::function<void(uint64_t waypoint, size_t pair, const AnswerRow& row,
                                      const std::string& problem)>;

  WaypointStream(const Client& client, Scope scope, Receiver receive);

  // How many waypoints go in one message.
  size_t lanes() const { return lanes_; }

  // Asks about `count` waypoints, at most lanes(): the poses of all moving parts, seven numbers
  // each, waypoint after waypoint. Answers come by waypoint, then by pair. No call may have more
  // waypoints than the first: INTERNAL.
  absl::Status Ask(size_t count, const std::vector<double>& poses);

  absl::Status Close();

 private:
  absl::StatusOr<v1::StreamCollisionsResponse> Open(size_t count, const std::vector<double>& poses);
  absl::StatusOr<v1::StreamCollisionsResponse> Update(size_t count,
                                                      const std::vector<double>& poses);
  absl::Status Take(const v1::StreamCollisionsResponse& answer, size_t count);
  std::string ProblemOf(uint32_t lane, size_t pair) const;

  const Client& client_;
  const Scope scope_;
  const Receiver receive_;
  size_t lanes_;
  std::unique_ptr<CollisionStream> stream_;
  // The lanes of the open stream.
  size_t open_lanes_ = 0;
  uint64_t waypoints_ = 0;
  std::unordered_map<uint32_t, std::string> placement_problems_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_WAYPOINT_STREAM_H_
