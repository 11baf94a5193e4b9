#ifndef HULLD_CLIENT_POINT_MESSAGES_H_
#define HULLD_CLIENT_POINT_MESSAGES_H_

#include <absl/status/status.h>

#include <cstddef>
#include <functional>
#include <span>

#include "hulld/v1/geometry.pb.h"

namespace hulld {

// Points per message of about 1 MiB: far below the 4 MiB message limit, and large enough to
// amortize the cost of a message.
inline constexpr size_t kPointsPerMessage = 40000;

// Sends points, n x 3, in messages of at most kPointsPerMessage. Stops at the first error of `send`
// and returns it.
absl::Status SendInMessages(std::span<const double> xyz,
                            const std::function<absl::Status(v1::PointBlock)>& send);

}  // namespace hulld

#endif  // HULLD_CLIENT_POINT_MESSAGES_H_
