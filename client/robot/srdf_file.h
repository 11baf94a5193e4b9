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

// Two links of a robot by their indices, the lower one first.
using LinkPair = std::pair<int, int>;
LinkPair MakeLinkPair(int a, int b);

// The pairs of links that a semantic description (SRDF, as MoveIt writes it) leaves out: of
// disable_collisions, and of disable_default_collisions without enable_collisions. - is standard
// input. INVALID_ARGUMENT names file and line: XML that is not well-formed, an element without its
// links, a link that the robot does not have.
absl::StatusOr<std::set<LinkPair>> ReadDisabledPairs(const std::string& path, const Robot& robot);
absl::StatusOr<std::set<LinkPair>> ParseDisabledPairs(const std::string& text,
                                                      const std::string& name, const Robot& robot);

// The pairs of links that are next to each other: a joint connects them, or a chain of joints
// through links on which nothing collides. MoveIt calls them adjacent and leaves them out.
std::set<LinkPair> AdjacentPairs(const Robot& robot);

// Why a pair is left out, in the words of MoveIt's files.
struct DisabledPair {
  LinkPair links;
  // "Adjacent", "Never", "Always".
  std::string reason;
};

// Writes a semantic description with these pairs. `comment` says where it comes from.
void WriteSrdf(const Robot& robot, const std::vector<DisabledPair>& pairs,
               const std::string& comment, std::ostream& out);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_SRDF_FILE_H_
