#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_FILE_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_FILE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/byte_source.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// The form in which a scene places the bodies that its YAML file defines.
enum class BodyForm {
  // As bodies of the server, created by 'hullctl scene apply'; poses compose exactly.
  kWhole,
  // As the hulls of their pieces, named NAME/PIECE, at poses composed in floating point: for
  // TEXTBOOK_SAT, which supports only hulls.
  kPieces
};

// Hulls and bodies at poses, and their queried pairs.
struct Scene {
  // Placements, in one of their two forms; groups and movers; wanted fields and the tolerance.
  v1::FindCollisionsRequest request;
  // Pairs named in the file, two indices into the placements each. Absent: all pairs that groups
  // and movers allow.
  std::optional<std::vector<uint32_t>> pairs;
  v1::Method method = v1::METHOD_UNSPECIFIED;
  // For a stream: answer updates by changes only.
  bool only_changes = false;
  // Names of the placements; empty for a request of the contract.
  std::vector<std::string> names;
  // For a YAML scene: the file's body of each placement, -1 for none; and the names of the pieces
  // of each body.
  std::vector<int> body_of;
  std::vector<std::vector<std::string>> piece_names;
  // IDs of the hulls and bodies that a YAML scene defines.
  std::set<std::string> defined_ids;

  uint32_t size() const;
  // Returns the hull of a placement, empty for an inline shape; null if the placement does not
  // exist.
  const std::string* HullOf(uint32_t placement) const;
  // Returns a placement, in either form. Requires HullOf(placement) != nullptr (unchecked:
  // ReadScene and PairsOf ensure it).
  v1::Placement PlacementOf(uint32_t placement) const;
  // Returns the placement's name, or its index and hull, as in "0:spider" or "1:points"; only the
  // index if it does not exist.
  std::string NameOf(uint32_t placement) const;
  // Returns the file's names for the deciding pieces of two placements, given by their indices;
  // empty if it has none.
  std::array<std::string, 2> NamesOfPieces(uint32_t a, uint32_t b,
                                           std::pair<int32_t, int32_t> pieces) const;
  // Returns a message or error of the server with the keys and names of the YAML scene in place of
  // the fields of the contract; unchanged for other scenes.
  std::string InKeys(const std::string& message) const;
  absl::Status InKeys(const absl::Status& status) const;
  // Returns the message of a problem with a placement, with a remedy if the file defines its hull
  // or body.
  std::string ProblemText(uint32_t placement, const v1::PlacementProblem& problem) const;
};

// Maximum number of pairs queried from one file.
inline constexpr uint64_t kMaxPairs = uint64_t{1} << 24;

// Text about scenes in --help.
inline constexpr char kSceneFileHelp[] =
    "FILE is a scene in YAML or JSON; 'hullctl scene apply --help' lists all keys:\n"
    "  place:\n"
    "    left: {id: arm}                                 # a hull or body of the server\n"
    "    right: {id: box, at: [2, 0, 0]}                 # x, y, z\n"
    "    turned: {id: box, at: [1, 0, 0, 1, 0, 0, 5]}    # w, x, y, z and x, y, z\n"
    "  ask: {pairs: [[left, right]]}                     # default: all pairs\n"
    "Programs can write a FindCollisionsRequest, BatchCheckCollisionsRequest or "
    "CollisionStreamOpen\n"
    "of the contract as JSON instead, with hulls and poses as flat lists:\n"
    "  {\"packedPlacements\":{\"hullIds\":[\"arm\",\"box\"], \"hulls\":[0,1],\n"
    "                       \"poses\":[1,0,0,0, 0,0,0,  1,0,0,0, 2,0,0]},\n"
    "   \"groups\":[0,1], \"ignoreSameGroup\":true, \"wanted\":{\"clearance\":0.1}}";

// Reads only the scene at the start of the source: an object in braces up to the end of the line
// with its last brace, any other YAML up to the end. INVALID_ARGUMENT "NAME:LINE: message",
// "NAME:LINE:COLUMN: message" for YAML, or "NAME: message" for a request of several lines. The
// error for a file in the old line format shows its YAML equivalent. Opens none of the files named
// in a YAML scene; 'hullctl scene apply' does.
absl::StatusOr<Scene> ReadScene(ByteSource* source, BodyForm form = BodyForm::kWhole);

// Returns the pairs of the scene, two indices each: the named pairs, or all that groups and movers
// allow. INVALID_ARGUMENT: more than kMaxPairs, none, or groups that do not match the placements.
absl::StatusOr<std::vector<uint32_t>> PairsOf(const Scene& scene, const std::string& file);

// Reads a file that contains nothing but a scene; "-" is standard input. INVALID_ARGUMENT as in
// ReadScene, or naming the line: updates of a stream follow, which `command` does not use.
absl::StatusOr<Scene> ReadWholeScene(const std::string& path, const std::string& command,
                                     BodyForm form = BodyForm::kWhole);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_FILE_H_
