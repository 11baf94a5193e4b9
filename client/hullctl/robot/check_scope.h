#ifndef HULLD_CLIENT_HULLCTL_ROBOT_CHECK_SCOPE_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_CHECK_SCOPE_H_

#include <absl/status/status.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client/hullctl/robot/robot_model.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Hulls and bodies on the server that surround a robot.
struct Surroundings {
  std::vector<std::string> hulls;
  std::vector<double> radii;
  // Seven numbers each.
  std::vector<double> poses;
};

// The objects of a robot's checks: its parts, which move, then its surroundings.
struct CheckScope {
  // Hulls and inline shapes; no placements.
  v1::PackedPlacements hulls;
  // For each object, its hull as in PackedPlacements.hulls, and its radius.
  std::vector<uint32_t> hull_of;
  std::vector<double> radii;
  uint32_t parts = 0;
  std::vector<double> fixed_poses;
  // Two objects each.
  std::vector<uint32_t> pairs;
};

// Requires a prepared model (PrepareHulls).
CheckScope MakeCheckScope(const RobotModel& model, const Surroundings& around,
                          std::vector<uint32_t> pairs);

// Removes the pairs that --ignore excludes. ignored: entries "NAME,NAME", where a name is that of a
// link, a part, or a placement; names: of the parts, then of the surroundings; pairs: two indices
// into names each. INVALID_ARGUMENT: an entry excludes no pair.
absl::Status RemoveIgnored(const std::vector<std::string>& ignored, const RobotModel& model,
                           const std::vector<std::string>& names, std::vector<uint32_t>* pairs);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_CHECK_SCOPE_H_
