#ifndef HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_
#define HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/hullctl/view/page_session.h"

namespace hulld {

// Returns the current content of a scene, for a page without a bridge (protocol.h): shapes,
// colliding pairs, and, for scenes of at most kMostRecordedObjects objects, the full answer for
// each pair. Returns errors of the calls.
absl::StatusOr<std::string> RecordScene(const ViewProgram& program, const ViewScene& scene);

inline constexpr size_t kMostRecordedObjects = 12;

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_
