#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_DESCRIPTION_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_DESCRIPTION_H_

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/pose/rigid_pose.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// What a scene file in YAML says, names resolved.

// What coordinates of a file are multiplied or divided by; each is rounded once.
struct LengthScale {
  double factor = 1;
  double divisor = 1;

  double Apply(double x) const { return x * factor / divisor; }
  bool is_one() const { return factor == 1 && divisor == 1; }
};

// A hull that the file defines, by the points of another file or by points that it lists itself.
struct HullDefinition {
  std::string name;
  // With the prefix.
  std::string hull_id;
  // As it can be opened, relative names already put behind the folder of the scene file.
  std::string file;
  LengthScale scale;
  // Where `file` is empty: x y z each.
  std::vector<double> xyz;
  // "NAME:LINE:COLUMN" of the definition, for errors.
  std::string where;
};

// A hull at a pose: a piece of a body.
struct PieceDefinition {
  std::string name;
  std::string hull_id;
  RigidPose X_BP = kNoMotion;
};

struct BodyDefinition {
  std::string name;
  // With the prefix.
  std::string body_id;
  std::vector<PieceDefinition> pieces;
};

struct PlacementDefinition {
  std::string name;
  // One of the two.
  std::string hull_id;
  int body = -1;
  RigidPose X_WO = kNoMotion;
  // Members of a group are never asked about together. Empty: none.
  std::string group;
};

struct SceneDescription {
  std::string prefix;
  std::vector<HullDefinition> hulls;
  std::vector<BodyDefinition> bodies;
  std::vector<PlacementDefinition> placements;
  // Two names each, of placements or groups, that are never asked about together.
  std::vector<std::pair<std::string, std::string>> ignored;
  // Indices of the placements that are asked about: two each.
  std::optional<std::vector<std::pair<int, int>>> pairs;
  // Indices of the placements one of which each pair must have. Empty: all.
  std::vector<int> movers;
  v1::Wanted wanted;
  double tolerance = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_DESCRIPTION_H_
