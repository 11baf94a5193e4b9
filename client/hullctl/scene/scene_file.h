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

// How the bodies that a scene in YAML defines are placed.
enum class BodyForm {
  // As bodies of the server, where 'hullctl scene apply' puts them; poses compose exactly.
  kWhole,
  // As the hulls of their pieces, named NAME/PIECE, at poses composed in floating point: for
  // TEXTBOOK_SAT, which takes hulls alone.
  kPieces
};

// Hulls and bodies at poses, and which pairs of them are asked about: what every format of a scene
// comes to.
struct Scene {
  // Placements, in one of their two forms; groups and movers; what is wanted, and the tolerance.
  v1::FindCollisionsRequest request;
  // The pairs that the file names, two indices into the placements each. Absent: all that groups
  // and movers leave.
  std::optional<std::vector<uint32_t>> pairs;
  v1::Method method = v1::METHOD_UNSPECIFIED;
  // For a stream: answer updates by changes only.
  bool only_changes = false;
  // The names of the placements; none where the format has none.
  std::vector<std::string> names;
  // For a scene in YAML: the body of the file that each placement stands for, -1 for none; and the
  // names of the pieces of each body.
  std::vector<int> body_of;
  std::vector<std::vector<std::string>> piece_names;

  uint32_t size() const;
  // The hull of a placement; null where there is no such placement, or it names no hull.
  const std::string* HullOf(uint32_t placement) const;
  // A placement, whatever form it has. Requires HullOf(placement) != nullptr; unchecked, as
  // ReadScene and PairsOf make sure of it.
  v1::Placement PlacementOf(uint32_t placement) const;
  // The placement's name, or its index and hull, as in "0:spider".
  std::string NameOf(uint32_t placement) const;
  // The names that the file has for the pieces that decided about two placements, given by their
  // indices; empty where it has none.
  std::array<std::string, 2> NamesOfPieces(uint32_t a, uint32_t b,
                                           std::pair<int32_t, int32_t> pieces) const;
};

// The most pairs that one file may ask for.
inline constexpr uint64_t kMostPairs = uint64_t{1} << 24;

// What --help says of the formats.
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

// Reads the scene at the front of the source, and no further: a text or YAML to its end, a JSON
// object to the end of the line that its last brace is on. INVALID_ARGUMENT "NAME:LINE: message",
// "NAME:LINE:COLUMN: message" for YAML, or "NAME: message" for an object of several lines. YAML
// names files and hulls that 'hullctl scene apply' puts on the server; none is opened here.
absl::StatusOr<Scene> ReadScene(ByteSource* source, BodyForm form = BodyForm::kWhole);

// The pairs of the scene, two indices each: named, or all that groups and movers leave.
// INVALID_ARGUMENT: there are more than kMostPairs, or none; or groups do not fit the placements.
absl::StatusOr<std::vector<uint32_t>> PairsOf(const Scene& scene, const std::string& file);

// INVALID_ARGUMENT, naming the line, when updates of a stream follow the scene, for which `command`
// has no use.
absl::Status RefuseUpdates(ByteSource* source, const std::string& command);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_FILE_H_
