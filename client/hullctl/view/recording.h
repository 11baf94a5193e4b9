#ifndef HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_
#define HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/hullctl/view/page_session.h"

namespace hulld {

inline constexpr size_t kMaxRecordedAnswers = 2000;
// Steps of the time of a scene with motions, as in page/motion.js.
inline constexpr int kRecordedSteps = 64;

// Returns the current content of a scene, for a page without a bridge (protocol.h): shapes and, at
// each waypoint or step of the time, poses and colliding pairs. The full answer for each pair of
// objects is included if these are at most kMaxRecordedAnswers; so is its first contact. Returns
// errors of the calls.
absl::StatusOr<std::string> RecordScene(const ViewProgram& program, const ViewScene& scene);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_RECORDING_H_
