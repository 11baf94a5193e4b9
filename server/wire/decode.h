#ifndef HULLD_SERVER_WIRE_DECODE_H_
#define HULLD_SERVER_WIRE_DECODE_H_

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_field.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/collision.h"
#include "core/query/terms/pose.h"
#include "hulld/v1/collision.pb.h"
#include "hulld/v1/freshness.pb.h"
#include "hulld/v1/geometry.pb.h"
#include "hulld/v1/hull.pb.h"
#include "server/registry/registry.h"
#include "server/shards/shard_types.h"

namespace hulld::server {

// The points of a block; they may still hold NaN or infinity, which the builder finds.
// INVALID_ARGUMENT: both fields of points set, or a number of coordinates that is no multiple of
// three. RESOURCE_EXHAUSTED: more than max_points (--max-points-per-chunk).
absl::StatusOr<std::vector<Vector>> DecodePoints(const v1::PointBlock& block, uint64_t max_points);

// The chunk of a message; its points may still hold NaN or infinity, which the builder finds.
// INVALID_ARGUMENT: sequence 0, both fields of points set, or a number of coordinates that is no
// multiple of three. RESOURCE_EXHAUSTED: more than max_points (--max-points-per-chunk).
absl::StatusOr<Chunk> DecodeChunk(const v1::AppendChunk& message, uint64_t max_points);

// A pose; absent parts mean identity. INVALID_ARGUMENT names the coordinate, as in "rotation.w".
absl::StatusOr<Pose> DecodePose(const v1::Pose& message);
// The same without a check.
Pose ReadPose(const v1::Pose& message);

// Poses in a row have seven numbers each: quaternion w x y z and translation x y z.
inline constexpr int kPoseNumbers = 7;
// The i-th of such poses, without a check (ValidatePose). Cost: 2 ns.
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

// How fresh the answer to a read must be that began at this time; an empty message means
// linearizable, as an absent one does. store_ids: those of all shards. INVALID_ARGUMENT: a negative
// or malformed duration, or a revision without the store. FAILED_PRECONDITION: a revision is of
// another store.
absl::StatusOr<ShardsFreshness> DecodeFreshness(const v1::Freshness& message,
                                                std::span<const std::string> store_ids,
                                                SteadyClock::time_point began);

// INVALID_ARGUMENT: a number that means no method.
absl::StatusOr<Method> DecodeMethod(v1::Method method);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_DECODE_H_
