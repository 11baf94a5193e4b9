#include "tests/bench/service/ball_hull.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

namespace hulld::bench {

void Require(const grpc::Status& status, const char* what) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s: %s\n", what, status.error_message().c_str());
  std::exit(1);
}

void MakeBallHull(v1::HullService::Stub& stub, const std::string& hull_id, int points,
                  double radius) {
  grpc::ClientContext context;
  const auto stream = stub.AppendPoints(&context);
  v1::AppendPointsRequest open;
  open.mutable_open()->set_hull_id(hull_id);
  open.mutable_open()->set_create_if_absent(true);
  // Chunks within a server's default limit.
  constexpr int kPointsPerChunk = 100'000;
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
  v1::AppendPointsResponse reply;
  bool is_open = stream->Write(open) && stream->Read(&reply);
  v1::AppendPointsRequest request;
  for (int i = 0; i < points && is_open; ++i) {
    const double z = 1 - (2 * i + 1.0) / points;
    const double r = std::sqrt(1 - z * z);
    v1::AppendChunk* const chunk = request.mutable_chunk();
    for (const double x : {r * std::cos(turn * i), r * std::sin(turn * i), z}) {
      chunk->mutable_points()->add_xyz(radius * x);
    }
    if ((i + 1) % kPointsPerChunk != 0 && i + 1 < points) continue;
    chunk->set_sequence(i / kPointsPerChunk + 1);
    is_open = stream->Write(request) && stream->Read(&reply);
    chunk->mutable_points()->Clear();
  }
  stream->WritesDone();
  Require(stream->Finish(), "AppendPoints");
}

}  // namespace hulld::bench
