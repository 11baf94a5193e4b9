#ifndef HULLD_CLIENT_HULLCTL_PARTS_VOLUME_COMPARISON_H_
#define HULLD_CLIENT_HULLCTL_PARTS_VOLUME_COMPARISON_H_

#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Minimum volume ratio at which a hull is reported as a poor fit for its mesh.
inline constexpr double kVolumeRatioToWarn = 1.5;

// Returns "1.07 times the mesh", or the reason why no comparison is possible. ratio: see
// VolumeRatio.
std::string VolumeRatioText(std::optional<double> ratio);

// Warns if the hull is so much larger than the mesh that it is a poor fit.
void WarnOfVolumeRatio(const Invocation& run, const std::string& hull_id,
                       std::optional<double> ratio);

// Returns the meshes of all files as one. Nullopt if a file has none (not IsMeshFormat, an input
// that can be read only once, or no triangle), or if they exceed 64 MiB, as they are held in
// memory.
std::optional<TriangleMesh> MeshOf(const std::vector<ReadRequest>& files);

// The volume of the hull divided by that of the mesh (see VolumeRatio). `text` is empty if the
// ratio is meaningless: the hull has received more points than `points`, so it also has points from
// elsewhere.
struct VolumeComparison {
  std::string text;
  std::optional<double> ratio;
};
absl::StatusOr<VolumeComparison> CompareVolumes(const Client& client, const std::string& hull_id,
                                                uint64_t points, const TriangleMesh& mesh);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PARTS_VOLUME_COMPARISON_H_
