#ifndef HULLD_TESTS_SERVER_HARNESS_TEST_SERVER_H_
#define HULLD_TESTS_SERVER_HARNESS_TEST_SERVER_H_

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "hulld/v1/status.grpc.pb.h"
#include "server/server.h"

namespace hulld::server {

// Coordinates, three per point.
using Coordinates = std::vector<double>;

// Returns the corners of the cube [low, low + size]^3.
Coordinates Cube(double low = 0, double size = 1);
// Returns `count` points on the unit sphere around (x, 0, 0), all extreme, evenly spread
// (Fibonacci).
Coordinates Sphere(int count, double x = 0);

v1::AppendPointsRequest OpenMessage(const std::string& hull_id, const std::string& writer_id,
                                    bool create_if_absent = false);
v1::AppendPointsRequest ChunkMessage(uint64_t sequence, const Coordinates& xyz,
                                     std::optional<uint64_t> if_revision = std::nullopt);
v1::Placement PlacementOf(const std::string& hull_id, double x = 0, double y = 0, double z = 0);

// A server on a free port of 127.0.0.1, and stubs that call it over TCP.
class ServerTest : public ::testing::Test {
 protected:
  // Restarts the server with other settings; call first in a test that needs them.
  void Restart(const Config& config);
  void SetUp() override;
  void TearDown() override;
  static Config TestConfig();

  v1::HullInfo Create(const std::string& hull_id);
  // Creates the hull and adds the points.
  void Put(const std::string& hull_id, const Coordinates& xyz);
  grpc::Status Delete(const std::string& hull_id);
  v1::GetHullResponse Get(const std::string& hull_id);
  v1::CheckCollisionResponse Check(const v1::CheckCollisionRequest& request);
  // Returns the status of a call that must fail.
  grpc::Status CheckError(const v1::CheckCollisionRequest& request);

  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::HullService::Stub> hulls_;
  std::unique_ptr<v1::CollisionService::Stub> collisions_;
  std::unique_ptr<v1::StatusService::Stub> status_;
};

// One AppendPoints stream.
class Appender {
 public:
  Appender(v1::HullService::Stub& stub, const std::string& hull_id, const std::string& writer_id,
           bool create_if_absent = false);

  // True if the server opened the stream.
  bool is_open() const { return open_; }
  const v1::AppendOpened& opened() const { return opened_.opened(); }

  bool Send(const v1::AppendPointsRequest& request) { return stream_->Write(request); }
  // Returns the next ack; nullopt at the end of the stream.
  std::optional<v1::AppendAck> ReadAck();
  // Sends a chunk and reads its ack.
  std::optional<v1::AppendAck> Append(uint64_t sequence, const Coordinates& xyz,
                                      std::optional<uint64_t> if_revision = std::nullopt);
  // Half-closes the stream, drains it, and returns its final status.
  grpc::Status Finish();
  void Cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AppendPointsRequest, v1::AppendPointsResponse>>
      stream_;
  v1::AppendPointsResponse opened_;
  bool open_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_TEST_SERVER_H_
