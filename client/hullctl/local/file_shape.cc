#include "client/hullctl/local/file_shape.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <array>
#include <filesystem>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/point_file.h"
#include "client/hullctl/body/hull_segment.h"
#include "client/hullctl/command_line/point_input.h"
#include "client/hullctl/local/local_server.h"

namespace hulld {
namespace {

// Stops reading a file with more distinct points than an inline shape may have.
absl::Status TooManyPoints() { return absl::OutOfRangeError("too many points"); }

// Reads the distinct points of a file.
absl::Status ReadDistinctPoints(const ReadRequest& request, v1::PointBlock* points) {
  absl::flat_hash_set<std::array<double, 3>> known;
  const auto add = [&](const auto& xyz) {
    for (size_t i = 0; i < xyz.size(); i += 3) {
      if (!known.insert({xyz[i], xyz[i + 1], xyz[i + 2]}).second) continue;
      points->mutable_xyz()->Add(xyz.begin() + i, xyz.begin() + i + 3);
    }
    return known.size() <= kMaxShapePoints ? absl::OkStatus() : TooManyPoints();
  };
  const auto receive = [&](const PointChunk& block) {
    const absl::Status added = add(block.xyz);
    return added.ok() ? add(block.xyz_float) : added;
  };
  return ReadPoints(request, receive).status();
}

Client::PointFeed FeedOf(const ReadRequest& request) {
  return [&request](const Client::PointSink& sink) {
    return ReadPoints(request, [&sink](const PointChunk& block) { return sink(ToProto(block)); })
        .status();
  };
}

// Sets `points` to the vertices of the hull of a file.
absl::Status ReadVertices(const ReadRequest& request, v1::PointBlock* points) {
  const auto mesh = LocalHullBuilder().Build(FeedOf(request));
  if (!mesh.ok()) {
    return absl::Status(mesh.status().code(),
                        absl::StrCat(request.path, " has more than ", kMaxShapePoints,
                                     " points, so a local server has to find the vertices: ",
                                     mesh.status().message()));
  }
  if (mesh->vertex_count() > kMaxShapePoints) {
    return absl::InvalidArgumentError(
        absl::StrCat(request.path, ": its hull has ", mesh->vertex_count(),
                     " vertices, but a query can carry at most ", kMaxShapePoints,
                     "; use --local, or register the hull with 'hullctl append'"));
  }
  points->mutable_xyz()->Assign(mesh->xyz.begin(), mesh->xyz.end());
  return absl::OkStatus();
}

}  // namespace

bool IsShapeFile(const std::string& argument) {
  if (argument.starts_with('.') || argument.starts_with('/')) return true;
  std::error_code ignored;
  return PointFormatOfPath(argument).ok() && std::filesystem::exists(argument, ignored);
}

absl::Status SetShape(const Invocation& run, const std::string& path, v1::Placement* placement) {
  HULLD_ASSIGN_OR_RETURN(const auto format, PointFormatOfPath(path));
  const ReadRequest request{path, format, {}, {}};
  v1::PointBlock points;
  absl::Status read = ReadDistinctPoints(request, &points);
  placement->clear_hull_id();
  if (absl::IsOutOfRange(read)) {
    points.Clear();
    if (run.local) {
      // The full path, to distinguish files in different folders.
      const std::string id = HullSegment(request.path);
      HULLD_RETURN_IF_ERROR(run.MakeClient().PutHull(id, FeedOf(request)));
      placement->set_hull_id(id);
      return absl::OkStatus();
    }
    read = ReadVertices(request, &points);
  }
  if (read.ok()) placement->mutable_points()->Swap(&points);
  return read;
}

absl::StatusOr<HullMesh> HullOfFile(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const auto format, PointFormatOfPath(path));
  ReadRequest request{path, format, {}, {}};
  request.options.skip_nonfinite = true;
  return LocalHullBuilder().Build(FeedOf(request));
}

absl::StatusOr<std::vector<HullMesh>> HullsOfShapes(const std::vector<v1::PointBlock>& shapes) {
  LocalHullBuilder builder;
  std::vector<HullMesh> hulls;
  for (const v1::PointBlock& shape : shapes) {
    HULLD_ASSIGN_OR_RETURN(
        auto hull, builder.Build([&](const Client::PointSink& sink) { return sink(shape); }));
    hulls.push_back(std::move(hull));
  }
  return hulls;
}

}  // namespace hulld
