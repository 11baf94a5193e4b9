#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_SYNC_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_SYNC_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/scene/scene_description.h"

namespace hulld {

// What it takes to make the server's hull or body that of the file.
enum class Change { kNone, kCreate, kReplace };

// The points of a definition, scaled, x y z each. INVALID_ARGUMENT starts with where the definition
// is and names the file and what is wrong with it.
absl::StatusOr<std::vector<double>> PointsOf(const HullDefinition& hull);

// Whether the server has the hull of these points under that ID: exact, each point in the hull and
// each vertex one of them. Reads only.
absl::StatusOr<Change> Compare(const Client& client, const std::string& hull_id,
                               const std::vector<double>& xyz);

// Whether the server has a body under that ID of the same pieces in the same order: the same hulls,
// at poses whose numbers are the same bit for bit. Reads only.
absl::StatusOr<Change> CompareBody(const Client& client, const BodyDefinition& body);

// Puts the hull of the points there, at once for all readers.
absl::Status PutHull(const Client& client, const std::string& hull_id,
                     const std::vector<double>& xyz);

// A hull or a body of the server.
struct Kept {
  std::string id;
  bool is_body = false;
  // When it was listed; none where it is damaged, or was not listed.
  std::optional<uint64_t> revision;
};

// Whether all under the scene's prefix is the scene's: a prefix is the beginning of any IDs, and
// only one that ends with "/" keeps them apart from those of others, as "cell-3" is the beginning
// of "cell-30/arm".
bool OwnsItsPrefix(const SceneDescription& scene);

// What the server has under the scene's prefix that the scene does not define, bodies first. None
// where the scene does not own its prefix.
absl::StatusOr<std::vector<Kept>> Strangers(const Client& client, const SceneDescription& scene);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_SYNC_H_
