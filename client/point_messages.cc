#include "client/point_messages.h"

#include <algorithm>
#include <utility>

namespace hulld {

absl::Status SendInMessages(std::span<const double> xyz,
                            const std::function<absl::Status(v1::PointBlock)>& send) {
  while (!xyz.empty()) {
    const auto numbers = xyz.first(std::min(xyz.size(), 3 * kPointsPerMessage));
    xyz = xyz.subspan(numbers.size());
    v1::PointBlock points;
    points.mutable_xyz()->Add(numbers.begin(), numbers.end());
    if (absl::Status sent = send(std::move(points)); !sent.ok()) return sent;
  }
  return absl::OkStatus();
}

}  // namespace hulld
