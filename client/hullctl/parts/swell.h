#ifndef HULLD_CLIENT_HULLCTL_PARTS_SWELL_H_
#define HULLD_CLIENT_HULLCTL_PARTS_SWELL_H_

#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// From this ratio of volumes on, a hull is said to represent its mesh badly.
inline constexpr double kSwellToWarn = 1.5;

// "1.07 times the mesh", or that there is nothing to compare. ratio: see VolumeRatio.
std::string SwellText(std::optional<double> ratio);

// Warns where the hull is so much larger than the mesh that it represents it badly.
void WarnOfSwell(const Invocation& run, const std::string& hull_id, std::optional<double> ratio);

// The meshes of all files as one. Nothing where a file has none: not IsMeshFormat, an input that
// is read once, or no triangle; or where they are more than 64 MiB, which would be held in memory.
std::optional<TriangleMesh> MeshOf(const std::vector<ReadRequest>& files);

// The volume of the hull over that of the mesh (see VolumeRatio). `text` is empty where there is
// nothing to say: the hull has points of elsewhere, too, as it received others than `points`.
struct Swell {
  std::string text;
  std::optional<double> ratio;
};
absl::StatusOr<Swell> SwellOf(const Client& client, const std::string& hull_id, uint64_t points,
                              const TriangleMesh& mesh);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PARTS_SWELL_H_
