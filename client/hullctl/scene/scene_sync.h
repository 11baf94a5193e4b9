#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_SYNC_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_SYNC_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/scene/scene_description.h"

namespace hulld {

// The change that makes the server's hull or body match the file.
enum class Change { kNone, kCreate, kReplace };

// Returns the points of a definition, scaled, n x 3. INVALID_ARGUMENT starts with the position of
// the definition and names the file and its defect.
absl::StatusOr<std::vector<double>> PointsOf(const HullDefinition& hull);

// Compares the server's hull of that ID with these points: exact, each point in the hull and each
// vertex one of them. Read-only.
absl::StatusOr<Change> Compare(const Client& client, const std::string& hull_id,
                               const std::vector<double>& xyz);

// Compares the server's body of that ID: the same hulls in the same order, at poses with bitwise
// equal numbers. Read-only.
absl::StatusOr<Change> CompareBody(const Client& client, const BodyDefinition& body);

// With --local, registers the hulls and bodies that a YAML scene defines; the server has no others.
// Ignores standard input and other files. Returns the first error, of a definition as in PointsOf
// or of a call.
absl::Status PutSceneIfLocal(const Invocation& run, const std::string& path);

// A hull or a body of the server.
struct ServerObject {
  std::string id;
  bool is_body = false;
  // Revision in the list; absent if it is damaged, or was not listed.
  std::optional<uint64_t> revision;
};

// Returns true if the scene owns all IDs under its prefix. A prefix matches the beginning of any
// ID, so only one that ends with "/" excludes foreign IDs: "cell-3" is also the beginning of
// "cell-30/arm".
bool OwnsItsPrefix(const SceneDescription& scene);

// Returns the unlisted objects: hulls and bodies under the scene's prefix that the scene does not
// define, bodies first. Empty if the scene does not own its prefix.
absl::StatusOr<std::vector<ServerObject>> UnlistedObjects(const Client& client,
                                                          const SceneDescription& scene);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_SYNC_H_
