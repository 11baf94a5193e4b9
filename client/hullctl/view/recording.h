#ifndef HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_
#define HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/hullctl/view/page_session.h"

namespace hulld {

// All that the page shows of one scene as it is now, for a page without a bridge (protocol.h):
// shapes, the pairs that collide, and, for scenes of at most kMostRecordedObjects objects, the full
// answer for each two. Errors are those of the calls.
absl::StatusOr<std::string> RecordScene(const ViewProgram& program, const ViewScene& scene);

inline constexpr size_t kMostRecordedObjects = 12;

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_
