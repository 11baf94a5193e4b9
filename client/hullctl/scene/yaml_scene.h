#ifndef HULLD_CLIENT_HULLCTL_SCENE_YAML_SCENE_H_
#define HULLD_CLIENT_HULLCTL_SCENE_YAML_SCENE_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/hullctl/scene/scene_description.h"
#include "client/hullctl/scene/scene_file.h"
#include "hulld/v1/body.pb.h"

namespace hulld {

// Keys of a scene.
inline constexpr const char* kSceneKeys[] = {"prefix", "scale",  "hulls", "bodies",
                                             "place",  "ignore", "ask"};

// Parses a YAML scene; for the keys see client/guide/SCENES.md. `name` appears in errors, and
// relative file names start at its folder. Opens none of the named files. INVALID_ARGUMENT
// "NAME:LINE:COLUMN: message": not YAML; an unknown key; a value of the wrong type; an undefined or
// duplicate name; more than kMaxPieces pieces.
absl::StatusOr<SceneDescription> ParseYamlScene(const std::string& text, const std::string& name);

// Reads a file; "-" is standard input.
absl::StatusOr<SceneDescription> ReadYamlScene(const std::string& path);

// Maximum total number of pieces of a scene's placements.
inline constexpr size_t kMaxPieces = size_t{1} << 22;

// Returns the request that creates the body on the server.
v1::PutBodyRequest BodyRequest(const BodyDefinition& body);

// Returns the placements in the form of the server. Pieces of a placement, members of a group, and
// ignored pairs are excluded. Movers come first. INVALID_ARGUMENT: more than kMaxPairs named
// pairs.
absl::StatusOr<Scene> ToScene(const SceneDescription& description, const std::string& name,
                              BodyForm form);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_YAML_SCENE_H_
