#include "client/hullctl/parts/volume_comparison.h"

#include <absl/strings/str_format.h>
#include <sys/stat.h>

#include "client/enclosure/mesh_volume.h"

namespace hulld {
namespace {

constexpr off_t kMaxSwellBytes = off_t{64} << 20;

}  // namespace

std::string VolumeRatioText(std::optional<double> ratio) {
  if (!ratio.has_value()) return "not compared: the mesh is not closed";
  return absl::StrFormat("%.4g times that of the mesh", *ratio);
}

void WarnOfVolumeRatio(const Invocation& run, const std::string& hull_id,
                       std::optional<double> ratio) {
  if (!ratio.has_value() || *ratio < kVolumeRatioToWarn) return;
  run.err << "hullctl: warning: the hull " << hull_id << " has " << absl::StrFormat("%.4g", *ratio)
          << " times the volume of its mesh; split the mesh into parts with --split or a convex "
             "decomposition\n";
}

std::optional<TriangleMesh> MeshOf(const std::vector<ReadRequest>& files) {
  TriangleMesh all;
  off_t bytes = 0;
  for (const ReadRequest& file : files) {
    struct stat info = {};
    const bool is_file = stat(file.path.c_str(), &info) == 0 && S_ISREG(info.st_mode);
    bytes += info.st_size;
    // The --format of a file may contradict its name.
    const auto named = PointFormatOfPath(file.path);
    const bool has_mesh = IsMeshFormat(file.format) && named.ok() && *named == file.format;
    if (!is_file || !has_mesh || bytes > kMaxSwellBytes) return std::nullopt;
    auto mesh = ReadMesh(file.path);
    // The points were read, so broken faces are not an error.
    if (!mesh.ok()) return std::nullopt;
    const auto first = static_cast<uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh->vertices.begin(), mesh->vertices.end());
    for (auto [a, b, c] : mesh->triangles) {
      all.triangles.push_back({a + first, b + first, c + first});
    }
  }
  if (all.triangles.empty()) return std::nullopt;
  return all;
}

absl::StatusOr<VolumeComparison> CompareVolumes(const Client& client, const std::string& hull_id,
                                                uint64_t points, const TriangleMesh& mesh) {
  const auto hull = client.GetHullMesh(hull_id);
  if (!hull.ok()) return hull.status();
  VolumeComparison volumes;
  if (hull->header.hull().counts().received() != points) return volumes;
  volumes.ratio = VolumeRatio(*hull, mesh);
  volumes.text = VolumeRatioText(volumes.ratio);
  return volumes;
}

}  // namespace hulld
