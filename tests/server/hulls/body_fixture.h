#ifndef HULLD_TESTS_SERVER_HULLS_BODY_FIXTURE_H_
#define HULLD_TESTS_SERVER_HULLS_BODY_FIXTURE_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "client/calls/grpc_status.h"
#include "client/client.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {

class BodyTest : public ServerTest {
 protected:
  Client MakeClient() const {
    ClientOptions options;
    options.server = server_->address();
    options.own_connection = true;
    // Reports a refusal instead of retrying until the deadline.
    options.retry.max_attempts = 1;
    return Client(options);
  }

  static v1::PutBodyRequest BodyOf(const std::string& body_id,
                                   const std::vector<v1::Placement>& pieces) {
    v1::PutBodyRequest request;
    request.set_body_id(body_id);
    for (const v1::Placement& piece : pieces) *request.add_pieces() = piece;
    return request;
  }

  absl::StatusOr<v1::PutBodyResponse> PutBody(const std::string& body_id,
                                              const std::vector<v1::Placement>& pieces,
                                              std::optional<uint64_t> if_revision = {}) const {
    v1::PutBodyRequest request = BodyOf(body_id, pieces);
    if (if_revision) request.set_if_revision(*if_revision);
    return MakeClient().PutBody(request);
  }

  // Puts two unit cubes, 4 apart along x, as one body.
  void PutPair(const std::string& body_id) {
    Put("cube", Cube());
    ASSERT_TRUE(PutBody(body_id, {PlacementOf("cube"), PlacementOf("cube", 5, 0, 0)}).ok());
  }

  absl::StatusOr<v1::CheckCollisionResponse> CheckPair(const v1::Placement& a,
                                                       const v1::Placement& b,
                                                       const v1::Wanted& wanted = {}) const {
    v1::CheckCollisionRequest request;
    *request.mutable_a() = a;
    *request.mutable_b() = b;
    *request.mutable_wanted() = wanted;
    return MakeClient().CheckCollision(request);
  }
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HULLS_BODY_FIXTURE_H_
