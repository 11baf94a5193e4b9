#ifndef HULLD_CLIENT_ROBOT_SRDF_FILE_H_
#define HULLD_CLIENT_ROBOT_SRDF_FILE_H_

#include <absl/status/statusor.h>

#include <ostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/robot/robot.h"

namespace hulld {

// Indices of two links of a robot, the lower one first.
using LinkPair = std::pair<int, int>;
LinkPair MakeLinkPair(int a, int b);

// Reads the pairs of links that a semantic description (SRDF, as written by MoveIt) disables: the
// pairs of disable_collisions, and of disable_default_collisions without enable_collisions. "-" is
// standard input. INVALID_ARGUMENT names file and line: malformed XML, an element without its
// links, or a link that the robot lacks.
absl::StatusOr<std::set<LinkPair>> ReadDisabledPairs(const std::string& path, const Robot& robot);
absl::StatusOr<std::set<LinkPair>> ParseDisabledPairs(const std::string& text,
                                                      const std::string& name, const Robot& robot);

// Returns the adjacent pairs of links: connected by a joint, or by a chain of joints through links
// without collision shapes. MoveIt disables these pairs. Planar and floating joints do not connect
// links here, because their links can move apart and into each other.
std::set<LinkPair> AdjacentPairs(const Robot& robot);

// A disabled pair, with the reason in the terms of MoveIt's files.
struct DisabledPair {
  LinkPair links;
  // "Adjacent", "Never", "Always".
  std::string reason;
};

// Writes a semantic description with these pairs. `comment` states its origin.
void WriteSrdf(const Robot& robot, const std::vector<DisabledPair>& pairs,
               const std::string& comment, std::ostream& out);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_SRDF_FILE_H_
