#ifndef HULLD_SERVER_WIRE_DECODE_H_
#define HULLD_SERVER_WIRE_DECODE_H_

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_field.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/collision.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/pose.h"
#include "hulld/v1/collision.pb.h"
#include "hulld/v1/freshness.pb.h"
#include "hulld/v1/geometry.pb.h"
#include "hulld/v1/hull.pb.h"
#include "server/registry/body_resolution.h"
#include "server/registry/registry.h"

namespace hulld::server {

// Decodes a block of points. They may be NaN or infinite, which the builder checks.
// INVALID_ARGUMENT: both point fields are set, or the number of coordinates is not a multiple of
// three. RESOURCE_EXHAUSTED: more than max_points (--max-points-per-chunk).
absl::StatusOr<std::vector<Vector>> DecodePoints(const v1::PointBlock& block, uint64_t max_points);

// Adds the inline shape with these points. INVALID_ARGUMENT, as in "points[17].y is NaN": both
// point fields are set, or the number of coordinates is not a multiple of three; CheckShape.
absl::Status DecodeShape(const v1::PointBlock& block, InlineShapes* shapes);
// INVALID_ARGUMENT: no point, more than Config::kMaxShapePoints, or one that is not finite.
absl::Status CheckShape(std::span<const Vector> points);

// Returns the revision that a change depends on, if any.
template <typename Request>
std::optional<uint64_t> IfRevision(const Request& request) {
  return request.has_if_revision() ? std::optional(request.if_revision()) : std::nullopt;
}

// Decodes a chunk. Its points may be NaN or infinite, which the builder checks. INVALID_ARGUMENT:
// sequence 0, both point fields are set, or the number of coordinates is not a multiple of three.
// RESOURCE_EXHAUSTED: more than max_points (--max-points-per-chunk).
absl::StatusOr<Chunk> DecodeChunk(const v1::AppendChunk& message, uint64_t max_points);

// Returns a pose without validation (ValidatePose); absent parts mean identity.
Pose ReadPose(const v1::Pose& message);

// Returns true if a radius of a placement or of a piece is valid: finite and at least 0.
inline bool IsValidRadius(double radius) { return radius >= 0 && radius < kInfinity; }
// Returns OK, or INVALID_ARGUMENT " is NaN; it must be ...", to follow the name of the field.
absl::Status ValidateRadius(double radius);
// Returns OK, or INVALID_ARGUMENT about the end of a motion with a valid start, naming the
// coordinate: it is malformed, or the rotation vanishes along the way.
absl::Status ValidateEnd(const Motion& motion);
// Packed poses have seven numbers each: quaternion w x y z and translation x y z.
inline constexpr int kPoseNumbers = 7;
// Returns the i-th packed pose without validation (ValidatePose). Cost: 2 ns.
inline Pose ReadPose(const google::protobuf::RepeatedField<double>& poses, size_t i) {
  const double* const numbers = poses.data() + kPoseNumbers * i;
  return {{numbers[0], numbers[1], numbers[2], numbers[3]},
          Vector(numbers[4], numbers[5], numbers[6])};
}
inline void WritePose(const Pose& pose, size_t i, google::protobuf::RepeatedField<double>* poses) {
  double* const numbers = poses->mutable_data() + kPoseNumbers * i;
  for (int k = 0; k < 4; ++k) numbers[k] = pose.q[k];
  for (int k = 0; k < 3; ++k) numbers[4 + k] = pose.t[k];
}

// Returns the freshness required by a read of this store that started at `began`. An empty or
// absent message means linearizable. INVALID_ARGUMENT: a negative or malformed duration, or a
// revision without a store ID. FAILED_PRECONDITION: the revision belongs to another store.
absl::StatusOr<Freshness> DecodeFreshness(const v1::Freshness& message, const Store& store,
                                          SteadyClock::time_point began);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_DECODE_H_
