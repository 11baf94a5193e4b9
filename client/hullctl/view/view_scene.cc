#include "client/hullctl/view/view_scene.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/byte_source.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"
#include "client/hullctl/local/file_shape.h"
#include "client/hullctl/scene/scene_file.h"
#include "client/packed_placements.h"

namespace hulld {
namespace {

absl::Status ReadMeshShape(const std::string& path, FileShape* shape) {
  HULLD_ASSIGN_OR_RETURN(const TriangleMesh mesh, ReadMesh(path));
  SetMesh(mesh, shape);
  return absl::OkStatus();
}

// Keeps every 2^k-th point, with the smallest sufficient k.
absl::Status ReadPointShape(const std::string& path, PointFormat format, FileShape* shape) {
  ReadRequest request{path, format, {}, {}};
  request.options.skip_nonfinite = true;
  uint64_t step = 1;
  const auto keep = [&](double x, double y, double z) {
    if (shape->point_count++ % step != 0) return;
    shape->xyz.insert(shape->xyz.end(), {x, y, z});
    if (shape->xyz.size() < 3 * kMaxDrawnPoints) return;
    size_t half = 0;
    for (size_t i = 0; i < shape->xyz.size(); i += 6, half += 3) {
      std::copy_n(shape->xyz.begin() + static_cast<ptrdiff_t>(i), 3,
                  shape->xyz.begin() + static_cast<ptrdiff_t>(half));
    }
    shape->xyz.resize(half);
    step *= 2;
  };
  const auto keep_all = [&keep](const auto& xyz) {
    for (size_t i = 0; i < xyz.size(); i += 3) keep(xyz[i], xyz[i + 1], xyz[i + 2]);
  };
  const auto receive = [&](const PointChunk& block) {
    keep_all(block.xyz);
    keep_all(block.xyz_float);
    return absl::OkStatus();
  };
  return ReadPoints(request, receive).status();
}

}  // namespace

RigidPose PoseAt(const ViewMotion& motion, double t) {
  RigidPose pose;
  for (size_t i = 0; i < pose.size(); ++i) {
    pose[i] = (1 - t) * motion.start[i] + t * motion.end[i];
  }
  return pose;
}

void SetMesh(const TriangleMesh& mesh, FileShape* shape) {
  shape->point_count = mesh.vertices.size();
  for (const auto& vertex : mesh.vertices) {
    shape->xyz.insert(shape->xyz.end(), vertex.begin(), vertex.end());
  }
  for (const auto& triangle : mesh.triangles) {
    shape->triangles.insert(shape->triangles.end(), triangle.begin(), triangle.end());
  }
}

std::string ShownName(const std::string& path) {
  return Printable(std::filesystem::path(path).filename().string());
}

absl::StatusOr<FileShape> ReadShape(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const auto format, PointFormatOfPath(path));
  FileShape shape;
  shape.name = ShownName(path);
  absl::Status read = IsMeshFormat(format) ? ReadMeshShape(path, &shape) : absl::OkStatus();
  // A PLY file without faces is a cloud.
  if (read.ok() && shape.xyz.empty()) read = ReadPointShape(path, format, &shape);
  if (!read.ok()) return read;
  return shape;
}

bool IsFile(const std::string& argument) {
  std::error_code ignored;
  return std::filesystem::exists(argument, ignored) &&
         !std::filesystem::is_directory(argument, ignored);
}

bool IsSceneFile(const std::string& path) {
  if (path.ends_with(".json") || path.ends_with(".yaml") || path.ends_with(".yml")) return true;
  const auto format = PointFormatOfPath(path);
  std::error_code ignored;
  if (format.value_or(PointFormat::kXyz) != PointFormat::kXyz ||
      !std::filesystem::is_regular_file(path, ignored)) {
    return false;
  }
  const auto source = ByteSource::Open(path);
  std::string_view line;
  while (source.ok() && (*source)->ReadLine(&line)) {
    const std::string_view text = Trim(line);
    if (text.empty() || text.front() == '#') continue;
    // Lines of the old format are refused with their YAML equivalent. The colon of ParaView's
    // column Points:0 is no mapping.
    return text.front() == '{' || text.ends_with(':') ||
           text.find(": ") != std::string_view::npos || text.starts_with("place ");
  }
  return false;
}

absl::Status AddHullsAndBodies(const Client& client, const std::string& id_or_prefix,
                               ViewScene* scene) {
  HULLD_ASSIGN_OR_RETURN(const auto hulls, client.ListAllHulls(id_or_prefix));
  HULLD_ASSIGN_OR_RETURN(const auto bodies, client.ListAllBodies(id_or_prefix));
  std::vector<std::string> ids;
  std::unordered_set<std::string> pieces;
  for (const v1::BodyInfo& body : bodies.bodies()) {
    ids.push_back(body.body_id());
    // Without permission to read its pieces, the page reports that for the body itself.
    const auto whole = client.GetBody(body.body_id());
    if (!whole.ok()) continue;
    for (const v1::Placement& piece : whole->pieces()) pieces.insert(piece.hull_id());
  }
  for (const v1::HullInfo& hull : hulls.hulls()) ids.push_back(hull.hull_id());
  if (ids.empty() && !id_or_prefix.empty()) {
    return absl::NotFoundError(
        absl::StrCat("no hull, body, prefix, or file \"", id_or_prefix, "\""));
  }
  std::sort(ids.begin(), ids.end());
  const auto add = [scene](const std::string& id) {
    scene->objects.push_back({id, id, -1, kNoMotion});
  };
  if (std::binary_search(ids.begin(), ids.end(), id_or_prefix)) {
    add(id_or_prefix);
    return absl::OkStatus();
  }
  for (const std::string& id : ids) {
    if (!pieces.contains(id)) add(id);
  }
  scene->pieces.insert(scene->pieces.end(), pieces.begin(), pieces.end());
  scene->prefixes.push_back(id_or_prefix);
  return absl::OkStatus();
}

namespace {

// Gives the objects at `indices` the hulls of their inline shapes. Each hull becomes a file of the
// scene, which the page requests.
absl::Status AddShapes(const std::vector<size_t>& indices,
                       const std::vector<v1::PointBlock>& shapes, ViewScene* scene) {
  if (shapes.empty()) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(auto hulls, HullsOfShapes(shapes));
  for (size_t i = 0; i < indices.size(); ++i) {
    ViewObject& object = scene->objects[indices[i]];
    auto file = std::make_shared<FileShape>();
    file->name = object.name;
    file->hull = std::make_shared<const HullMesh>(std::move(hulls[i]));
    file->xyz = file->hull->xyz;
    file->point_count = file->hull->vertex_count();
    file->hull_name = object.name;
    object.hull = file->hull;
    object.hull_id = file->hull_name;
    object.file = static_cast<int>(scene->files.size());
    scene->files.push_back(std::move(file));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status AddSceneFile(const std::string& path, ViewScene* scene) {
  HULLD_ASSIGN_OR_RETURN(const auto source, ByteSource::Open(path));
  HULLD_ASSIGN_OR_RETURN(Scene file, ReadScene(source.get()));
  std::vector<size_t> indices;
  std::vector<v1::PointBlock> shapes;
  for (uint32_t i = 0; i < file.size(); ++i) {
    const std::string& hull_id = *file.HullOf(i);
    v1::Placement placement = file.PlacementOf(i);
    const std::string& name =
        file.names.empty() && !placement.has_points() ? hull_id : file.NameOf(i);
    ViewObject& object = scene->objects.emplace_back(
        ViewObject{name, hull_id, -1, NumbersOf(placement.pose()), placement.radius()});
    if (placement.has_end_pose()) {
      const ViewMotion motion{object.pose, NumbersOf(placement.end_pose())};
      if (motion.start != motion.end) object.motion = motion;
    }
    if (!placement.has_points()) continue;
    indices.push_back(scene->objects.size() - 1);
    shapes.push_back(std::move(*placement.mutable_points()));
  }
  HULLD_RETURN_IF_ERROR(AddShapes(indices, shapes, scene));
  scene->pairs = std::move(file.pairs);
  scene->rules = std::move(file.request);
  scene->rules.clear_placements();
  scene->rules.clear_packed_placements();
  // The page shows only relations here.
  scene->rules.clear_wanted();
  return absl::OkStatus();
}

}  // namespace hulld
