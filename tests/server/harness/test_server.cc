#include "tests/server/harness/test_server.h"

#include <cmath>
#include <numbers>

namespace hulld::server {

Coordinates Cube(double low, double size) {
  Coordinates xyz;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) xyz.push_back(low + ((corner >> axis) & 1) * size);
  }
  return xyz;
}

Coordinates Sphere(int count, double x) {
  Coordinates xyz;
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double height = 1 - (2 * i + 1.0) / count;
    const double radius = std::sqrt(1 - height * height);
    xyz.insert(xyz.end(), {x + radius * std::cos(turn * i), radius * std::sin(turn * i), height});
  }
  return xyz;
}

v1::AppendPointsRequest OpenMessage(const std::string& hull_id, const std::string& writer_id,
                                    bool create_if_absent) {
  v1::AppendPointsRequest request;
  request.mutable_open()->set_hull_id(hull_id);
  request.mutable_open()->set_writer_id(writer_id);
  request.mutable_open()->set_create_if_absent(create_if_absent);
  return request;
}

v1::AppendPointsRequest ChunkMessage(uint64_t sequence, const Coordinates& xyz,
                                     std::optional<uint64_t> if_revision) {
  v1::AppendPointsRequest request;
  v1::AppendChunk* chunk = request.mutable_chunk();
  chunk->set_sequence(sequence);
  chunk->mutable_points()->mutable_xyz()->Assign(xyz.begin(), xyz.end());
  if (if_revision.has_value()) chunk->set_if_revision(*if_revision);
  return request;
}

v1::Placement PlacementOf(const std::string& hull_id, double x, double y, double z) {
  v1::Placement placement;
  placement.set_hull_id(hull_id);
  v1::Vector3* translation = placement.mutable_pose()->mutable_translation();
  translation->set_x(x);
  translation->set_y(y);
  translation->set_z(z);
  return placement;
}

Config ServerTest::TestConfig() {
  Config config;
  config.listen = "127.0.0.1:0";
  config.threads = 2;
  config.store = "memory";
  return config;
}

void ServerTest::SetUp() { Restart(TestConfig()); }

void ServerTest::Restart(const Config& config) {
  TearDown();
  absl::StatusOr<std::unique_ptr<Server>> server = Server::Start(config);
  ASSERT_TRUE(server.ok()) << server.status().ToString();
  server_ = *std::move(server);
  // Avoids a connection of another channel to a previous server at the same address.
  grpc::ChannelArguments own;
  own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  channel_ = grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), own);
  hulls_ = v1::HullService::NewStub(channel_);
  collisions_ = v1::CollisionService::NewStub(channel_);
  status_ = v1::StatusService::NewStub(channel_);
}

void ServerTest::TearDown() {
  hulls_.reset();
  collisions_.reset();
  status_.reset();
  channel_.reset();
  server_.reset();
}

v1::HullInfo ServerTest::Create(const std::string& hull_id) {
  grpc::ClientContext context;
  v1::CreateHullRequest request;
  v1::CreateHullResponse response;
  request.set_hull_id(hull_id);
  const grpc::Status status = hulls_->CreateHull(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.hull();
}

void ServerTest::Put(const std::string& hull_id, const Coordinates& xyz) {
  Appender appender(*hulls_, hull_id, "put", true);
  ASSERT_TRUE(appender.is_open()) << appender.Finish().error_message();
  const std::optional<v1::AppendAck> ack = appender.Append(1, xyz);
  const grpc::Status status = appender.Finish();
  ASSERT_TRUE(ack.has_value() && status.ok()) << status.error_message();
}

grpc::Status ServerTest::Delete(const std::string& hull_id) {
  grpc::ClientContext context;
  v1::DeleteHullRequest request;
  v1::DeleteHullResponse response;
  request.set_hull_id(hull_id);
  return hulls_->DeleteHull(&context, request, &response);
}

v1::GetHullResponse ServerTest::Get(const std::string& hull_id) {
  grpc::ClientContext context;
  v1::GetHullRequest request;
  v1::GetHullResponse response;
  request.set_hull_id(hull_id);
  const grpc::Status status = hulls_->GetHull(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

v1::CheckCollisionResponse ServerTest::Check(const v1::CheckCollisionRequest& request) {
  grpc::ClientContext context;
  v1::CheckCollisionResponse response;
  const grpc::Status status = collisions_->CheckCollision(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

grpc::Status ServerTest::CheckError(const v1::CheckCollisionRequest& request) {
  grpc::ClientContext context;
  v1::CheckCollisionResponse response;
  const grpc::Status status = collisions_->CheckCollision(&context, request, &response);
  EXPECT_FALSE(status.ok()) << response.ShortDebugString();
  return status;
}

Appender::Appender(v1::HullService::Stub& stub, const std::string& hull_id,
                   const std::string& writer_id, bool create_if_absent)
    : stream_(stub.AppendPoints(&context_)) {
  open_ = stream_->Write(OpenMessage(hull_id, writer_id, create_if_absent)) &&
          stream_->Read(&opened_) && opened_.has_opened();
}

std::optional<v1::AppendAck> Appender::ReadAck() {
  v1::AppendPointsResponse response;
  if (!stream_->Read(&response) || !response.has_ack()) return std::nullopt;
  return response.ack();
}

std::optional<v1::AppendAck> Appender::Append(uint64_t sequence, const Coordinates& xyz,
                                              std::optional<uint64_t> if_revision) {
  Send(ChunkMessage(sequence, xyz, if_revision));
  return ReadAck();
}

grpc::Status Appender::Finish() {
  stream_->WritesDone();
  v1::AppendPointsResponse rest;
  while (stream_->Read(&rest)) {
  }
  return stream_->Finish();
}

}  // namespace hulld::server
