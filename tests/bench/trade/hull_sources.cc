#include "tests/bench/trade/hull_sources.h"

#include <vector>

#include "client/client.h"
#include "client/formats/point_file.h"
#include "core/hull/growth/hull_builder.h"

namespace hulld::bench {
namespace {

absl::Status AddTo(HullBuilder& builder, const std::vector<double>& xyz) {
  std::vector<Vector> points;
  for (size_t i = 0; i + 2 < xyz.size(); i += 3)
    points.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
  return builder.Add(points).status();
}

}  // namespace

absl::StatusOr<Hull> HullOfFile(const std::string& path) {
  const absl::StatusOr<PointFormat> format = PointFormatOfPath(path);
  if (!format.ok()) return format.status();
  HullBuilder builder;
  const auto receive = [&](PointChunk block) {
    block.xyz.insert(block.xyz.end(), block.xyz_float.begin(), block.xyz_float.end());
    return AddTo(builder, block.xyz);
  };
  ReadRequest request;
  request.path = path;
  request.format = *format;
  const absl::StatusOr<ReadCounts> counts = ReadPoints(request, receive);
  if (!counts.ok()) return counts.status();
  if (builder.dimension() < 0) return absl::InvalidArgumentError(path + ": holds no point");
  return builder.Snapshot();
}

absl::StatusOr<Hull> HullOfServer(const std::string& server, const std::string& hull_id) {
  ClientOptions options;
  options.server = server;
  const absl::StatusOr<HullMesh> mesh = Client(options).GetHullMesh(hull_id);
  if (!mesh.ok()) return mesh.status();
  HullBuilder builder;
  if (absl::Status added = AddTo(builder, mesh->xyz); !added.ok()) return added;
  if (builder.dimension() < 0) {
    return absl::InvalidArgumentError("hull \"" + hull_id + "\" is empty");
  }
  return builder.Snapshot();
}

}  // namespace hulld::bench
