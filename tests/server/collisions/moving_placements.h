#ifndef HULLD_TESTS_SERVER_COLLISIONS_MOVING_PLACEMENTS_H_
#define HULLD_TESTS_SERVER_COLLISIONS_MOVING_PLACEMENTS_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/verify/answer_check.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace moving_placements {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr v1::Relation kSeparated = v1::RELATION_SEPARATED;
inline constexpr v1::Relation kTouching = v1::RELATION_TOUCHING;
inline constexpr v1::Relation kOverlapping = v1::RELATION_OVERLAPPING;

inline void Turn(double w, double x, double y, double z, v1::Pose* pose) {
  pose->mutable_rotation()->set_w(w);
  pose->mutable_rotation()->set_x(x);
  pose->mutable_rotation()->set_y(y);
  pose->mutable_rotation()->set_z(z);
}

inline v1::Placement MovingTo(v1::Placement placement, double x, double y = 0, double z = 0) {
  v1::Vector3* const translation = placement.mutable_end_pose()->mutable_translation();
  translation->set_x(x);
  translation->set_y(y);
  translation->set_z(z);
  return placement;
}

inline v1::Placement Shape(const std::vector<double>& xyz) {
  v1::Placement placement;
  placement.mutable_points()->mutable_xyz()->Assign(xyz.begin(), xyz.end());
  return placement;
}

inline v1::CheckCollisionRequest Pair(const v1::Placement& a, const v1::Placement& b) {
  v1::CheckCollisionRequest request;
  *request.mutable_a() = a;
  *request.mutable_b() = b;
  return request;
}

inline v1::BatchCheckCollisionsRequest Batch(const std::vector<v1::Placement>& placements,
                                             const std::vector<uint32_t>& pairs) {
  v1::BatchCheckCollisionsRequest request;
  for (const v1::Placement& placement : placements) *request.add_placements() = placement;
  request.mutable_pairs()->Assign(pairs.begin(), pairs.end());
  return request;
}

// A rod that turns by 90 degrees about z, and a box that it meets halfway, at (3, 4, 0).
inline v1::Placement TurningRod() {
  v1::Placement rod = Shape({0, 0, 0, 5, 0, 0});
  Turn(1, 0, 0, 1, rod.mutable_end_pose());
  return rod;
}
inline v1::Placement Ceiling() { return Shape({0, 4, -1, 6, 4, -1, 0, 4, 1, 6, 4, 1, 3, 5, 0}); }

inline std::string MessageOf(const absl::Status& status) { return std::string(status.message()); }

class MovingPlacements : public ServerTest {
 protected:
  Client client() const {
    ClientOptions options;
    options.retry.max_attempts = 1;
    return Client(options, channel_);
  }

  // Expects an answer whose certificate the client verifies; returns it.
  v1::CheckCollisionResponse Proven(v1::CheckCollisionRequest request) {
    request.mutable_wanted()->set_certificate(true);
    const auto verified = CheckCollisionVerified(client(), request);
    if (!verified.ok()) {
      ADD_FAILURE() << verified.status();
      return {};
    }
    EXPECT_EQ(verified->verification.verdict, Verdict::kValid)
        << verified->verification.reason << "\n"
        << verified->response.ShortDebugString();
    return verified->response;
  }

  // Expects that the pair meets at this time, and that this is proven.
  void ExpectMeets(const v1::Placement& a, const v1::Placement& b, v1::Relation relation,
                   double time) {
    const v1::CheckCollisionResponse response = Check(Pair(a, b));
    EXPECT_EQ(response.relation(), relation);
    EXPECT_EQ(response.first_contact().contact_time(), time);
    EXPECT_FALSE(response.has_certificate());
    EXPECT_TRUE(response.first_contact().intervals().empty());
    EXPECT_EQ(Proven(Pair(a, b)).first_contact().contact_time(), time);
  }

  void ExpectRefused(const v1::CheckCollisionRequest& request, const std::string& message) {
    const grpc::Status status = CheckError(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), ::testing::StartsWith(message));
  }

  absl::StatusOr<v1::FindCollisionsResponse> Find(const v1::FindCollisionsRequest& request) {
    v1::FindCollisionsResponse scene;
    const absl::Status status =
        client().FindCollisions(request, [&](const v1::FindCollisionsResponse& part) {
          scene.MergeFrom(part);
          return absl::OkStatus();
        });
    if (!status.ok()) return status;
    return scene;
  }

  absl::StatusOr<v1::BatchCheckCollisionsResponse> CheckBatch(
      const v1::BatchCheckCollisionsRequest& request) {
    v1::BatchCheckCollisionsResponse whole;
    const absl::Status status =
        client().BatchCheckCollisions(request, [&](const v1::BatchCheckCollisionsResponse& part) {
          // Each message numbers its own rows.
          v1::BatchCheckCollisionsResponse next = part;
          for (v1::MotionProof& proof : *next.mutable_columns()->mutable_motion_proofs()) {
            proof.set_row(proof.row() + part.first_pair());
          }
          whole.MergeFrom(next);
          return absl::OkStatus();
        });
    if (!status.ok()) return status;
    return whole;
  }
};

}  // namespace moving_placements
}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_COLLISIONS_MOVING_PLACEMENTS_H_
