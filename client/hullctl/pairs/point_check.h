#ifndef HULLD_CLIENT_HULLCTL_PAIRS_POINT_CHECK_H_
#define HULLD_CLIENT_HULLCTL_PAIRS_POINT_CHECK_H_

#include <string>

#include "client/hullctl/command_line/invocation.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Prints for each point of a file whether it is inside `hull`, on its boundary, or outside; with
// the separation, if wanted. The points are in the world frame. Each call carries a part of the
// file, within the server's limits; memory does not grow with the file.
ExitCode CheckPoints(const Invocation& run, const v1::Placement& hull, const std::string& file,
                     const v1::Wanted& wanted);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PAIRS_POINT_CHECK_H_
