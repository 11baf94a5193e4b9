#ifndef HULLD_CLIENT_HULLCTL_SCENE_YAML_SCENE_H_
#define HULLD_CLIENT_HULLCTL_SCENE_YAML_SCENE_H_

#include <absl/status/statusor.h>

#include <string>
#include <string_view>

#include "client/hullctl/scene/scene_description.h"
#include "client/hullctl/scene/scene_file.h"
#include "hulld/v1/body.pb.h"

namespace hulld {

// Whether a scene whose first line with something on it is this one is written in YAML.
bool LooksLikeYaml(std::string_view line);

// Reads a scene in YAML; client/README.md#scene-files tells its keys. `name` stands in errors, and
// relative names of files start at its folder. No file that it names is opened. INVALID_ARGUMENT
// "NAME:LINE:COLUMN: message": no YAML; an unknown key; a value of another kind; a name that is not
// defined, or twice; more than kMostPieces pieces.
absl::StatusOr<SceneDescription> ParseYamlScene(const std::string& text, const std::string& name);

// The same of a file; - is standard input.
absl::StatusOr<SceneDescription> ReadYamlScene(const std::string& path);

// The most pieces that the placements of a scene may come to.
inline constexpr size_t kMostPieces = size_t{1} << 22;

// The body as it is put on the server.
v1::PutBodyRequest BodyRequest(const BodyDefinition& body);

// The placements as the server takes them. Pieces of one placement, members of one group, and what
// is ignored are never asked about together. Movers come first. INVALID_ARGUMENT: more pairs than
// kMostPairs are named.
absl::StatusOr<Scene> ToScene(const SceneDescription& description, const std::string& name,
                              BodyForm form);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_YAML_SCENE_H_
