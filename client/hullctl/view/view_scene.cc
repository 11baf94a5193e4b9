#include "client/hullctl/view/view_scene.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "client/formats/byte_source.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

bool HasTriangles(PointFormat format) {
  return format == PointFormat::kObj || format == PointFormat::kOff ||
         format == PointFormat::kStl || format == PointFormat::kGltf;
}

absl::Status ReadMeshShape(const std::string& path, FileShape* shape) {
  const auto mesh = ReadMesh(path);
  if (!mesh.ok()) return mesh.status();
  shape->point_count = mesh->vertices.size();
  for (const auto& vertex : mesh->vertices) {
    shape->xyz.insert(shape->xyz.end(), vertex.begin(), vertex.end());
  }
  for (const auto& triangle : mesh->triangles) {
    shape->triangles.insert(shape->triangles.end(), triangle.begin(), triangle.end());
  }
  return absl::OkStatus();
}

// Keeps every 2^k-th point, with k as large as needed.
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
  return ReadPoints(request,
                    [&](const PointBlock& block) {
                      for (size_t i = 0; i < block.xyz.size(); i += 3) {
                        keep(block.xyz[i], block.xyz[i + 1], block.xyz[i + 2]);
                      }
                      for (size_t i = 0; i < block.xyz_float.size(); i += 3) {
                        keep(block.xyz_float[i], block.xyz_float[i + 1], block.xyz_float[i + 2]);
                      }
                      return absl::OkStatus();
                    })
      .status();
}

}  // namespace

// Source: the table of well-formed sequences of the Unicode Standard, section 3.9.
std::string ShownName(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  for (size_t i = 0; i < name.size();) {
    const auto byte = [&](size_t at) {
      return at < name.size() ? static_cast<unsigned char>(name[at]) : 0u;
    };
    const unsigned lead = byte(i);
    const size_t length = lead < 0x80   ? 1
                          : lead < 0xc2 ? 0
                          : lead < 0xe0 ? 2
                          : lead < 0xf0 ? 3
                          : lead < 0xf5 ? 4
                                        : 0;
    bool good = length > 0;
    for (size_t k = 1; k < length; ++k) good = good && (byte(i + k) & 0xc0) == 0x80;
    if (lead == 0xe0) good = good && byte(i + 1) >= 0xa0;
    if (lead == 0xed) good = good && byte(i + 1) < 0xa0;
    if (lead == 0xf0) good = good && byte(i + 1) >= 0x90;
    if (lead == 0xf4) good = good && byte(i + 1) < 0x90;
    if (!good) name[i] = '?';
    i += good ? length : 1;
  }
  return name;
}

absl::StatusOr<FileShape> ReadShape(const std::string& path) {
  const auto format = PointFormatOfPath(path);
  if (!format.ok()) return format.status();
  FileShape shape;
  shape.name = ShownName(path);
  const absl::Status read =
      HasTriangles(*format) ? ReadMeshShape(path, &shape) : ReadPointShape(path, *format, &shape);
  if (!read.ok()) return read;
  return shape;
}

bool IsFile(const std::string& argument) {
  std::error_code ignored;
  return std::filesystem::exists(argument, ignored) &&
         !std::filesystem::is_directory(argument, ignored);
}

absl::Status AddHulls(const Client& client, const std::string& id_or_prefix, ViewScene* scene) {
  const auto list = client.ListAllHulls(id_or_prefix);
  if (!list.ok()) return list.status();
  const auto& hulls = list->hulls();
  const bool exact = std::any_of(hulls.begin(), hulls.end(), [&](const v1::HullInfo& hull) {
    return hull.hull_id() == id_or_prefix;
  });
  if (hulls.empty() && !id_or_prefix.empty()) {
    return absl::NotFoundError(absl::StrCat("there is no hull \"", id_or_prefix,
                                            "\", none whose ID starts so, and no such file"));
  }
  for (const v1::HullInfo& hull : hulls) {
    if (exact && hull.hull_id() != id_or_prefix) continue;
    scene->objects.push_back({hull.hull_id(), hull.hull_id(), -1, kIdentityPose});
  }
  if (!exact) scene->prefixes.push_back(id_or_prefix);
  return absl::OkStatus();
}

Pose7 NumbersOf(const v1::Pose& pose) {
  Pose7 numbers = kIdentityPose;
  if (pose.has_rotation()) {
    const v1::Quaternion& q = pose.rotation();
    numbers = {q.w(), q.x(), q.y(), q.z(), 0, 0, 0};
  }
  const v1::Vector3& t = pose.translation();
  numbers[4] = t.x();
  numbers[5] = t.y();
  numbers[6] = t.z();
  return numbers;
}

absl::Status AddSceneFile(const std::string& path, ViewScene* scene) {
  const absl::StatusOr<std::string> text = ReadText(path);
  if (!text.ok()) return text.status();
  v1::FindCollisionsRequest& request = scene->rules;
  const auto wrong = [&path](absl::string_view message) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", message));
  };
  if (absl::Status s = ParseJson(*text, UnknownFields::kRefuse, &request); !s.ok()) {
    return wrong(s.message());
  }
  const v1::PackedPlacements& packed = request.packed_placements();
  if (packed.poses_size() != 7 * packed.hulls_size()) {
    return wrong("packedPlacements needs seven numbers in poses for each of hulls");
  }
  for (const v1::Placement& placement : request.placements()) {
    scene->objects.push_back(
        {placement.hull_id(), placement.hull_id(), -1, NumbersOf(placement.pose())});
  }
  for (int i = 0; i < packed.hulls_size(); ++i) {
    if (packed.hulls(i) >= static_cast<uint32_t>(packed.hull_ids_size())) {
      return wrong(absl::StrCat("packedPlacements.hulls[", i, "] is not the index of a hull ID"));
    }
    const std::string& hull_id = packed.hull_ids(static_cast<int>(packed.hulls(i)));
    ViewObject object{hull_id, hull_id, -1, kIdentityPose};
    std::copy_n(packed.poses().begin() + 7 * i, 7, object.pose.begin());
    scene->objects.push_back(std::move(object));
  }
  request.clear_placements();
  request.clear_packed_placements();
  // The page shows relations alone here.
  request.clear_wanted();
  return absl::OkStatus();
}

}  // namespace hulld
