#include "server/wire/decode.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/settings/config.h"

namespace hulld::server {
namespace {

// Coordinates: doubles or floats, three per point.
template <typename Coordinates>
absl::StatusOr<std::vector<Vector>> DecodePoints(const Coordinates& coordinates, const char* field,
                                                 uint64_t max_points) {
  static_assert(sizeof(Vector) == 3 * sizeof(double));
  if (coordinates.size() % 3 != 0) {
    return InvalidArgument(field, " has ", coordinates.size(), " numbers; each point needs three");
  }
  const auto count = static_cast<size_t>(coordinates.size()) / 3;
  if (count > max_points) {
    return LimitExceeded(absl::StrCat("message contains ", count, " points"), max_points,
                         "max-points-per-chunk");
  }
  std::vector<Vector> points(count);
  if (count > 0) std::copy(coordinates.begin(), coordinates.end(), points.front().data());
  return points;
}

absl::Status OtherStore(const Store& store) {
  return WithReason(absl::FailedPreconditionError(absl::StrCat(
                        "freshness.store_id differs from this store's ID, \"", store.id(),
                        "\": the revision belongs to another store, for example one from before a "
                        "restore; read without at_least_revision")),
                    v1::ERROR_REASON_OTHER_STORE, {{"store_id", store.id()}});
}

absl::StatusOr<std::chrono::nanoseconds> DecodeStaleness(
    const google::protobuf::Duration& message) {
  constexpr int64_t kNanosPerSecond = 1'000'000'000;
  // Far longer than any server runs, yet far below an overflow.
  constexpr int64_t kMaxSeconds = kNanosPerSecond;
  if (message.seconds() < 0 || message.nanos() < 0 || message.nanos() >= kNanosPerSecond) {
    return InvalidArgument("freshness.max_staleness is ", message.seconds(), " s and ",
                           message.nanos(), " ns; it must be at least 0, with nanos below 10^9");
  }
  if (message.seconds() >= kMaxSeconds) return std::chrono::seconds(kMaxSeconds);
  return std::chrono::seconds(message.seconds()) + std::chrono::nanoseconds(message.nanos());
}

}  // namespace

absl::StatusOr<std::vector<Vector>> DecodePoints(const v1::PointBlock& block, uint64_t max_points) {
  if (!block.xyz().empty() && !block.xyz_float().empty()) {
    return InvalidArgument("points has both xyz and xyz_float; set one of them");
  }
  if (!block.xyz_float().empty()) {
    return DecodePoints(block.xyz_float(), "points.xyz_float", max_points);
  }
  return DecodePoints(block.xyz(), "points.xyz", max_points);
}

absl::Status CheckShape(std::span<const Vector> points) {
  if (points.empty()) {
    return InvalidArgument("points is empty; give 1 to ", Config::kMaxShapePoints);
  }
  if (points.size() > Config::kMaxShapePoints) {
    return InvalidArgument("points has ", points.size(),
                           " points; the limit of an inline shape is ", Config::kMaxShapePoints,
                           "; give only the vertices of the hull, or register it");
  }
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].allFinite()) continue;
    const auto is_finite = [](double x) { return std::isfinite(x); };
    const auto k = std::ranges::find_if_not(points[i], is_finite) - points[i].begin();
    return InvalidArgument("points[", i, "].", std::string(1, "xyz"[k]), " is ",
                           std::isnan(points[i][k]) ? "NaN" : "infinite");
  }
  return absl::OkStatus();
}

absl::Status DecodeShape(const v1::PointBlock& block, InlineShapes* shapes) {
  HULLD_ASSIGN_OR_RETURN(const std::vector<Vector> points,
                         DecodePoints(block, std::numeric_limits<uint64_t>::max()));
  HULLD_RETURN_IF_ERROR(CheckShape(points));
  shapes->Add(points);
  return absl::OkStatus();
}

absl::StatusOr<Chunk> DecodeChunk(const v1::AppendChunk& message, uint64_t max_points) {
  if (message.sequence() == 0) {
    return InvalidArgument("chunk 0: sequence is 0 or missing; sequences start at 1");
  }
  absl::StatusOr<std::vector<Vector>> points = DecodePoints(message.points(), max_points);
  if (!points.ok()) {
    return Prefixed(absl::StrCat("chunk ", message.sequence(), ": "), points.status());
  }
  Chunk chunk;
  chunk.sequence = message.sequence();
  chunk.points = *std::move(points);
  chunk.if_revision = IfRevision(message);
  return chunk;
}

Pose ReadPose(const v1::Pose& message) {
  Pose pose;
  if (message.has_rotation()) {
    const v1::Quaternion& q = message.rotation();
    pose.q = {q.w(), q.x(), q.y(), q.z()};
  }
  if (message.has_translation()) {
    const v1::Vector3& t = message.translation();
    pose.t = Vector(t.x(), t.y(), t.z());
  }
  return pose;
}

absl::Status ValidateRadius(double radius) {
  if (IsValidRadius(radius)) return absl::OkStatus();
  return InvalidArgument(" is ",
                         std::isnan(radius)   ? "NaN"
                         : std::isinf(radius) ? "infinite"
                                              : absl::StrCat(radius),
                         "; it must be a finite length of at least 0");
}

absl::Status ValidateEnd(const Motion& motion) {
  if (!IsValidPose(motion.end)) return ValidatePose(motion.end);
  if (ValidateMotion(motion).ok()) return absl::OkStatus();
  return InvalidArgument(
      "rotation is opposite to the rotation of pose, so the interpolated quaternion passes through "
      "zero; negate its components to take the shorter path");
}

absl::StatusOr<Freshness> DecodeFreshness(const v1::Freshness& message, const Store& store,
                                          SteadyClock::time_point began) {
  Freshness freshness;
  freshness.began = began;
  freshness.at_least_revision = message.at_least_revision();
  if (message.at_least_revision() > 0 && message.store_id().empty()) {
    return InvalidArgument(
        "freshness.at_least_revision requires store_id; use the one from the same header");
  }
  if (!message.store_id().empty() && message.store_id() != store.id()) return OtherStore(store);
  if (message.has_max_staleness()) {
    HULLD_ASSIGN_OR_RETURN(std::chrono::nanoseconds bound,
                           DecodeStaleness(message.max_staleness()));
    freshness.max_staleness = bound;
  } else if (freshness.at_least_revision > 0) {
    freshness.max_staleness = std::nullopt;
  }
  return freshness;
}

}  // namespace hulld::server
