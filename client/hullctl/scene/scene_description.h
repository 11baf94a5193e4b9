#ifndef HULLD_CLIENT_HULLCTL_SCENE_SCENE_DESCRIPTION_H_
#define HULLD_CLIENT_HULLCTL_SCENE_SCENE_DESCRIPTION_H_

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/length_scale.h"
#include "client/pose/rigid_pose.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Content of a YAML scene file, with names resolved.

// A hull defined in the file, by a point file or by listed points.
struct HullDefinition {
  std::string name;
  // Including the prefix.
  std::string hull_id;
  // Path that can be opened: relative names have been resolved against the folder of the scene
  // file.
  std::string file;
  LengthScale scale;
  // If `file` is empty: n x 3.
  std::vector<double> xyz;
  // "NAME:LINE:COLUMN" of the definition, for errors.
  std::string where;
};

// A hull at a pose: a piece of a body.
struct PieceDefinition {
  std::string name;
  std::string hull_id;
  RigidPose X_BP = kNoMotion;
  double radius = 0;
};

struct BodyDefinition {
  std::string name;
  // Including the prefix.
  std::string body_id;
  std::vector<PieceDefinition> pieces;
};

struct PlacementDefinition {
  std::string name;
  // Exactly one of the two is set.
  std::string hull_id;
  int body = -1;
  RigidPose X_WO = kNoMotion;
  // The end of a motion.
  std::optional<RigidPose> X_WO_end;
  double radius = 0;
  // Pairs within a group are never queried. Empty: no group.
  std::string group;
};

struct SceneDescription {
  std::string prefix;
  std::vector<HullDefinition> hulls;
  std::vector<BodyDefinition> bodies;
  std::vector<PlacementDefinition> placements;
  // Pairs of names, of placements or groups, that are never queried.
  std::vector<std::pair<std::string, std::string>> ignored;
  // Pairs of indices of queried placements.
  std::optional<std::vector<std::pair<int, int>>> pairs;
  // Indices of placements; each pair must contain one. Empty: all.
  std::vector<int> movers;
  v1::Wanted wanted;
  double tolerance = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_SCENE_DESCRIPTION_H_
