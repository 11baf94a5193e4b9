#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_FILE_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_FILE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/byte_source.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Placement of the bodies that a YAML scene defines.
enum class BodyForm {
  // As bodies of the server, created by 'hullctl scene apply'; poses compose exactly.
  kWhole,
  // As the hulls of their pieces, named NAME/PIECE, at poses composed in floating point: for
  // TEXTBOOK_SAT, which takes only hulls.
  kPieces
};

// Hulls and bodies at poses, and their queried pairs: the common form of all scene formats.
struct Scene {
  // Placements, in one of their two forms; groups and movers; wanted fields and the tolerance.
  v1::FindCollisionsRequest request;
  // Pairs named in the file, two indices into the placements each. Absent: all pairs that groups
  // and movers allow.
  std::optional<std::vector<uint32_t>> pairs;
  v1::Method method = v1::METHOD_UNSPECIFIED;
  // For a stream: answer updates by changes only.
  bool only_changes = false;
  // Names of the placements; empty if the format has none.
  std::vector<std::string> names;
  // For a YAML scene: the file's body of each placement, -1 for none; and the names of the pieces
  // of each body.
  std::vector<int> body_of;
  std::vector<std::vector<std::string>> piece_names;

  uint32_t size() const;
  // Returns the hull of a placement; null if the placement does not exist or names no hull.
  const std::string* HullOf(uint32_t placement) const;
  // Returns a placement, in either form. Requires HullOf(placement) != nullptr; unchecked, as
  // ReadScene and PairsOf ensure it.
  v1::Placement PlacementOf(uint32_t placement) const;
  // Returns the placement's name, or its index and hull, as in "0:spider".
  std::string NameOf(uint32_t placement) const;
  // Returns the file's names for the deciding pieces of two placements, given by their indices;
  // empty if it has none.
  std::array<std::string, 2> NamesOfPieces(uint32_t a, uint32_t b,
                                           std::pair<int32_t, int32_t> pieces) const;
};

// Maximum number of pairs queried from one file.
inline constexpr uint64_t kMostPairs = uint64_t{1} << 24;

// Text about the formats in --help.
inline constexpr char kSceneFileHelp[] =
    "FILE is a scene, as YAML ('hullctl scene apply --help' shows it), as text or as JSON.\n"
    "As text, one item a line; # starts a comment:\n"
    "  place NAME HULL [[w x y z] tx ty tz]   a hull at a pose (none: as built)\n"
    "  pair NAME NAME                         ask about these two\n"
    "  all                                    ask about each two, as if no pair was named\n"
    "Names are free, each for one placement; pairs may come before their placements. As JSON, a\n"
    "FindCollisionsRequest, BatchCheckCollisionsRequest or CollisionStreamOpen of the contract:\n"
    "  {\"placements\":[{\"hullId\":\"arm\"},\n"
    "                 {\"hullId\":\"box\",\"pose\":{\"translation\":{\"x\":2}}},\n"
    "                 {\"hullId\":\"box\",\"pose\":{\"rotation\":{\"w\":1,\"z\":1}}}],\n"
    "   \"groups\":[0,1,1], \"ignoreSameGroup\":true, \"wanted\":{\"clearance\":0.1}}\n"
    "Optional: \"pairs\", two indices each; or a group for each placement, and which groups never\n"
    "collide, and \"movers\":N, for only the pairs with one of the first N; tolerance; and what "
    "is\n"
    "wanted. Many placements are read faster as packedPlacements: the IDs of the hulls, the index\n"
    "of each placement's hull, and its pose in seven numbers, w x y z and x y z:\n"
    "  {\"packedPlacements\":{\"hullIds\":[\"arm\",\"box\"], \"hulls\":[0,1],\n"
    "                       \"poses\":[1,0,0,0, 0,0,0,  1,0,0,0, 2,0,0]}}\n"
    "Updates of a stream may follow a JSON scene, one a line: see 'hullctl stream --help'.";

// Reads the scene at the start of the source, and no further: text or YAML to its end, a JSON
// object to the end of the line of its last brace. INVALID_ARGUMENT "NAME:LINE: message",
// "NAME:LINE:COLUMN: message" for YAML, or "NAME: message" for an object of several lines. Opens
// none of the files named in a YAML scene; 'hullctl scene apply' does.
absl::StatusOr<Scene> ReadScene(ByteSource* source, BodyForm form = BodyForm::kWhole);

// Returns the pairs of the scene, two indices each: the named pairs, or all that groups and movers
// allow. INVALID_ARGUMENT: more than kMostPairs, none, or groups that do not match the placements.
absl::StatusOr<std::vector<uint32_t>> PairsOf(const Scene& scene, const std::string& file);

// INVALID_ARGUMENT, naming the line: updates of a stream follow the scene, which `command` does not
// use.
absl::Status RefuseUpdates(ByteSource* source, const std::string& command);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_FILE_H_
