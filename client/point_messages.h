#ifndef HULLD_CLIENT_POINT_MESSAGES_H_
#define HULLD_CLIENT_POINT_MESSAGES_H_

#include <absl/status/status.h>

#include <cstddef>
#include <functional>
#include <span>

#include "hulld/v1/geometry.pb.h"

namespace hulld {

// Points of a message of about a MiB: far below the 4 MiB that a message may have, and far above
// what a message costs beside its points.
inline constexpr size_t kPointsPerMessage = 40000;

// Passes points on, x y z each, in messages of kPointsPerMessage at most. An error of `send` ends
// it and is returned.
absl::Status SendInMessages(std::span<const double> xyz,
                            const std::function<absl::Status(v1::PointBlock)>& send);

}  // namespace hulld

#endif  // HULLD_CLIENT_POINT_MESSAGES_H_
