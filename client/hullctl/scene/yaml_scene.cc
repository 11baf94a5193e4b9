#include "client/hullctl/scene/yaml_scene.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/hullctl/help/suggestion.h"
#include "client/hullctl/scene/yaml_reader.h"
#include "client/packed_placements.h"
#include "client/robot/shape_hull.h"

namespace hulld {
namespace {

struct UnitName {
  const char* name;
  // Meters, exact.
  const char* length;
};
constexpr UnitName kUnits[] = {
    {"mm", "0.001"}, {"cm", "0.01"}, {"m", "1"}, {"in", "0.0254"}, {"ft", "0.3048"}};

// Returns the folder of a file, with a trailing slash; empty for none.
std::string FolderOf(const std::string& path) {
  const size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "" : path.substr(0, slash + 1);
}

// Reads one document, part by part. Names are resolved independently of the order of parts in the
// file.
class SceneParser {
 public:
  SceneParser(const YamlReader& yaml, std::string file) : yaml_(yaml), file_(std::move(file)) {}

  absl::StatusOr<SceneDescription> Run() {
    HULLD_ASSIGN_OR_RETURN(
        const auto entries,
        yaml_.EntriesOf(yaml_.root(), "the scene", {std::begin(kSceneKeys), std::end(kSceneKeys)}));
    using Part = absl::Status (SceneParser::*)(const YAML::Node&);
    // In order of dependency.
    const std::pair<const char*, Part> parts[] = {
        {"prefix", &SceneParser::TakePrefix}, {"scale", &SceneParser::TakeScale},
        {"hulls", &SceneParser::TakeHulls},   {"bodies", &SceneParser::TakeBodies},
        {"place", &SceneParser::TakePlaces},  {"ignore", &SceneParser::TakeIgnored},
        {"ask", &SceneParser::TakeAsk}};
    for (const auto& [key, take] : parts) {
      for (const auto& [name, node] : entries) {
        if (name != key) continue;
        HULLD_RETURN_IF_ERROR((this->*take)(node));
      }
    }
    return std::move(scene_);
  }

 private:
  using Entries = YamlReader::Entries;

  absl::Status TakePrefix(const YAML::Node& node) {
    HULLD_ASSIGN_OR_RETURN(scene_.prefix, yaml_.Text(node, "prefix"));
    return absl::OkStatus();
  }

  absl::Status TakeScale(const YAML::Node& node) {
    HULLD_ASSIGN_OR_RETURN(scale_, ScaleOf(node));
    return absl::OkStatus();
  }

  absl::StatusOr<LengthScale> ScaleOf(const YAML::Node& node) const {
    HULLD_ASSIGN_OR_RETURN(const auto text, yaml_.Text(node, "scale"));
    for (const UnitName& unit : kUnits) {
      if (text == unit.name) return *LengthScale::FromText(unit.length);
    }
    if (const auto scale = LengthScale::FromText(text); scale.has_value()) return *scale;
    return yaml_.ErrorAt(
        node, absl::StrCat("scale: ", Quoted(text),
                           " is not a unit or a nonzero number; units are mm, cm, m, in, and ft"));
  }

  absl::Status TakeHulls(const YAML::Node& node) {
    HULLD_ASSIGN_OR_RETURN(const auto entries, yaml_.EntriesOf(node, "hulls"));
    for (const auto& [name, value] : entries) {
      HullDefinition hull;
      hull.name = name;
      hull.hull_id = scene_.prefix + name;
      hull.scale = scale_;
      hull.where = yaml_.PlaceOf(value);
      HULLD_RETURN_IF_ERROR(TakeHull(value, &hull));
      hull_ids_[name] = hull.hull_id;
      scene_.hulls.push_back(std::move(hull));
    }
    return absl::OkStatus();
  }

  absl::Status TakeHull(const YAML::Node& node, HullDefinition* hull) const {
    const std::string what = absl::StrCat("hull ", Quoted(hull->name));
    HULLD_ASSIGN_OR_RETURN(const auto entries,
                           yaml_.EntriesOf(node, what, {"file", "scale", "points", "box"}));
    int sources = 0;
    bool scaled = false;
    for (const auto& [key, value] : entries) {
      if (key == "scale") {
        HULLD_ASSIGN_OR_RETURN(hull->scale, ScaleOf(value));
        scaled = true;
        continue;
      }
      ++sources;
      if (key == "file") {
        HULLD_ASSIGN_OR_RETURN(const std::string file, yaml_.Text(value, "file"));
        hull->file = file.front() == '/' ? file : FolderOf(file_) + file;
      } else {
        HULLD_RETURN_IF_ERROR(key == "box" ? TakeBox(value, hull) : TakePoints(value, hull));
      }
    }
    if (sources != 1) {
      return yaml_.ErrorAt(node, absl::StrCat(what, " needs exactly one of file, points, and box"));
    }
    if (scaled && hull->file.empty()) {
      return yaml_.ErrorAt(node, absl::StrCat(what, ": scale needs a file"));
    }
    return absl::OkStatus();
  }

  // Reads edge lengths; the box is centered on the origin.
  absl::Status TakeBox(const YAML::Node& node, HullDefinition* hull) const {
    HULLD_ASSIGN_OR_RETURN(const auto size, yaml_.Numbers(node, "box", {3}));
    for (const double edge : size) {
      if (edge < 0) return yaml_.ErrorAt(node, "box edges must be at least 0");
    }
    hull->xyz = BoxCorners(std::span(size).first<3>());
    return absl::OkStatus();
  }

  absl::Status TakePoints(const YAML::Node& node, HullDefinition* hull) const {
    if (!node.IsSequence() || node.size() == 0) {
      return yaml_.ErrorAt(node, "points must be a list of points, as in [[0, 0, 0], [1, 0, 0]]");
    }
    for (const YAML::Node& point : node) {
      HULLD_ASSIGN_OR_RETURN(const auto xyz, yaml_.Numbers(point, "a point", {3}));
      hull->xyz.insert(hull->xyz.end(), xyz.begin(), xyz.end());
    }
    return absl::OkStatus();
  }

  // Reads a translation, a quaternion and a translation, or both by name. Without a rotation, that
  // of `pose` remains.
  absl::StatusOr<RigidPose> PoseOf(const YAML::Node& node, const std::string& key_of_pose = "at",
                                   RigidPose pose = kNoMotion) const {
    if (!node.IsMap()) {
      HULLD_ASSIGN_OR_RETURN(const auto numbers, yaml_.Numbers(node, key_of_pose, {3, 7}));
      std::copy(numbers.begin(), numbers.end(), pose.end() - numbers.size());
      return CheckedPose(node, key_of_pose, pose);
    }
    HULLD_ASSIGN_OR_RETURN(const auto entries,
                           yaml_.EntriesOf(node, key_of_pose, {"xyz", "rpy", "quaternion"}));
    int rotations = 0;
    for (const auto& [key, value] : entries) {
      const size_t count = key == "quaternion" ? 4 : 3;
      HULLD_ASSIGN_OR_RETURN(const auto numbers, yaml_.Numbers(value, key, {count}));
      const double* const x = numbers.data();
      if (key == "xyz") {
        std::copy(x, x + 3, pose.begin() + 4);
      } else if (key == "quaternion") {
        std::copy(x, x + 4, pose.begin());
        ++rotations;
      } else {
        const RigidPose turned = RotationOf({x[0], x[1], x[2]});
        std::copy(turned.begin(), turned.begin() + 4, pose.begin());
        ++rotations;
      }
    }
    if (rotations > 1) {
      return yaml_.ErrorAt(node, key_of_pose + " may have rpy or a quaternion, not both");
    }
    return CheckedPose(node, key_of_pose, pose);
  }

  absl::StatusOr<RigidPose> CheckedPose(const YAML::Node& node, const std::string& key,
                                        const RigidPose& pose) const {
    const bool turns = pose[0] != 0 || pose[1] != 0 || pose[2] != 0 || pose[3] != 0;
    if (turns) return pose;
    return yaml_.ErrorAt(node, key + ": the quaternion is zero; use 1, 0, 0, 0 for no rotation");
  }

  // Reads the end of a motion from X_WO; a translation alone keeps the rotation. The quaternion
  // gets the sign of the shorter path.
  absl::StatusOr<RigidPose> EndOf(const YAML::Node& node, const RigidPose& X_WO) const {
    RigidPose start = X_WO;
    std::fill(start.begin() + 4, start.end(), 0);
    HULLD_ASSIGN_OR_RETURN(const RigidPose end, PoseOf(node, "to", start));
    return OnShorterPath(X_WO, end);
  }

  // Reads a length of at least 0. YamlReader refuses numbers that are not finite.
  absl::StatusOr<double> LengthOf(const YAML::Node& node, const std::string& key) const {
    auto length = yaml_.Number(node, key);
    if (length.ok() && *length < 0) {
      return yaml_.ErrorAt(node, absl::StrCat(key, " must be at least 0"));
    }
    return length;
  }

  // Returns the ID of a hull defined in the file.
  absl::StatusOr<std::string> DefinedHull(const YAML::Node& node) const {
    HULLD_ASSIGN_OR_RETURN(const std::string name, yaml_.Text(node, "hull"));
    return Find(node, name, hull_ids_, "hull", "hulls", "; use id for a hull of the server");
  }

  absl::Status TakeBodies(const YAML::Node& node) {
    HULLD_ASSIGN_OR_RETURN(const auto entries, yaml_.EntriesOf(node, "bodies"));
    for (const auto& [name, value] : entries) {
      if (hull_ids_.contains(name)) {
        return yaml_.ErrorAt(
            value, absl::StrCat("hull ", Quoted(name),
                                " has the same name; names of hulls and bodies must differ"));
      }
      BodyDefinition body;
      body.name = name;
      body.body_id = scene_.prefix + name;
      if (!value.IsSequence() || value.size() == 0) {
        return yaml_.ErrorAt(value,
                             absl::StrCat("body ", Quoted(name),
                                          " must be a list of pieces, {hull: NAME, at: POSE} "
                                          "each"));
      }
      std::set<std::string> taken;
      for (const YAML::Node& piece : value) {
        HULLD_RETURN_IF_ERROR(TakePiece(piece, &taken, &body));
      }
      bodies_[name] = static_cast<int>(scene_.bodies.size());
      scene_.bodies.push_back(std::move(body));
    }
    return absl::OkStatus();
  }

  absl::Status TakePiece(const YAML::Node& node, std::set<std::string>* taken,
                         BodyDefinition* body) const {
    const std::string what = absl::StrCat("a piece of body ", Quoted(body->name));
    HULLD_ASSIGN_OR_RETURN(const auto entries,
                           yaml_.EntriesOf(node, what, {"hull", "id", "at", "radius"}));
    PieceDefinition piece;
    for (const auto& [key, value] : entries) {
      if (key == "at") {
        HULLD_ASSIGN_OR_RETURN(piece.X_BP, PoseOf(value));
        continue;
      }
      if (key == "radius") {
        HULLD_ASSIGN_OR_RETURN(piece.radius, LengthOf(value, key));
        continue;
      }
      if (!piece.hull_id.empty())
        return yaml_.ErrorAt(value, what + " may have hull or id, not both");
      HULLD_ASSIGN_OR_RETURN(auto id, key == "hull" ? DefinedHull(value) : yaml_.Text(value, "id"));
      piece.name = value.Scalar();
      piece.hull_id = std::move(id);
    }
    if (piece.hull_id.empty()) return yaml_.ErrorAt(node, what + " needs hull or id");
    const std::string name = piece.name;
    for (int number = 2; !taken->insert(piece.name).second; ++number) {
      piece.name = absl::StrCat(name, "-", number);
    }
    body->pieces.push_back(std::move(piece));
    return absl::OkStatus();
  }

  absl::Status TakePlaces(const YAML::Node& node) {
    HULLD_ASSIGN_OR_RETURN(const auto entries, yaml_.EntriesOf(node, "place"));
    for (const auto& [name, value] : entries) {
      PlacementDefinition placement;
      placement.name = name;
      HULLD_RETURN_IF_ERROR(TakePlace(value, &placement));
      pieces_ +=
          placement.body < 0 ? 1 : scene_.bodies[static_cast<size_t>(placement.body)].pieces.size();
      if (pieces_ > kMaxPieces) {
        return yaml_.ErrorAt(value, absl::StrCat("more than ", kMaxPieces, " pieces are placed"));
      }
      places_[name] = static_cast<int>(scene_.placements.size());
      if (!placement.group.empty()) groups_.insert(placement.group);
      scene_.placements.push_back(std::move(placement));
    }
    for (const auto& [name, value] : entries) {
      if (!groups_.contains(name)) continue;
      return yaml_.ErrorAt(
          value, absl::StrCat(Quoted(name), " names both a placement and a group; ", "rename one"));
    }
    return absl::OkStatus();
  }

  absl::Status TakePlace(const YAML::Node& node, PlacementDefinition* placement) const {
    const std::string what = absl::StrCat("placement ", Quoted(placement->name));
    HULLD_ASSIGN_OR_RETURN(
        const auto entries,
        yaml_.EntriesOf(node, what, {"hull", "body", "id", "at", "to", "radius", "group"}));
    int objects = 0;
    std::optional<YAML::Node> to;
    for (const auto& [key, value] : entries) {
      if (key == "to") {
        to = value;
        continue;
      }
      if (key == "at") {
        HULLD_ASSIGN_OR_RETURN(placement->X_WO, PoseOf(value));
        continue;
      }
      if (key == "radius") {
        HULLD_ASSIGN_OR_RETURN(placement->radius, LengthOf(value, key));
        continue;
      }
      if (key == "group") {
        HULLD_ASSIGN_OR_RETURN(placement->group, yaml_.Text(value, "group"));
        continue;
      }
      ++objects;
      if (key == "body") {
        HULLD_ASSIGN_OR_RETURN(placement->body, BodyOf(value));
        continue;
      }
      HULLD_ASSIGN_OR_RETURN(placement->hull_id,
                             key == "hull" ? DefinedHull(value) : yaml_.Text(value, "id"));
    }
    if (objects != 1) {
      return yaml_.ErrorAt(node, what + " needs exactly one of hull, body, and id");
    }
    if (!to.has_value()) return absl::OkStatus();
    HULLD_ASSIGN_OR_RETURN(placement->X_WO_end, EndOf(*to, placement->X_WO));
    return absl::OkStatus();
  }

  absl::StatusOr<int> BodyOf(const YAML::Node& node) const {
    HULLD_ASSIGN_OR_RETURN(const auto name, yaml_.Text(node, "body"));
    return Find(node, name, bodies_, "body", "bodies");
  }

  // Returns the value of a name defined under the key `where`. advice: in the error, if no other
  // name is similar.
  template <typename Value>
  absl::StatusOr<Value> Find(const YAML::Node& node, const std::string& name,
                             const std::map<std::string, Value>& among, const char* what,
                             const char* where, const char* advice = "") const {
    const auto found = among.find(name);
    if (found != among.end()) return found->second;
    std::vector<std::string> known;
    known.reserve(among.size());
    for (const auto& [key, value] : among) known.push_back(key);
    const std::string hint = Suggestion(name, known);
    return yaml_.ErrorAt(node, absl::StrCat(what, " ", Quoted(name), " is not defined under ",
                                            where, hint.empty() ? advice : hint));
  }

  absl::StatusOr<std::vector<std::string>> TwoNames(const YAML::Node& node,
                                                    const std::string& key) const {
    auto names = yaml_.Texts(node, key);
    if (names.ok() && names->size() != 2) {
      return yaml_.ErrorAt(node, absl::StrCat(key, " must be pairs of names, as in [[a, b]]"));
    }
    return names;
  }

  absl::Status TakeIgnored(const YAML::Node& node) {
    if (!node.IsSequence()) {
      return yaml_.ErrorAt(node, "ignore must be a list of pairs, as in [[a, b]]");
    }
    for (const YAML::Node& entry : node) {
      HULLD_ASSIGN_OR_RETURN(auto names, TwoNames(entry, "ignore"));
      for (size_t i = 0; i < 2; ++i) {
        const std::string& name = names[i];
        if (places_.contains(name) || groups_.contains(name)) continue;
        std::vector<std::string> known(groups_.begin(), groups_.end());
        for (const auto& [place, index] : places_) known.push_back(place);
        return yaml_.ErrorAt(entry[i],
                             absl::StrCat("ignore: ", Quoted(name), " is not a placement or group",
                                          Suggestion(name, known)));
      }
      scene_.ignored.emplace_back(names[0], names[1]);
    }
    return absl::OkStatus();
  }

  absl::Status TakeAsk(const YAML::Node& node) {
    HULLD_ASSIGN_OR_RETURN(
        const auto entries,
        yaml_.EntriesOf(node, "ask",
                        {"pairs", "movers", "axis", "separation", "max_error", "witness", "normal",
                         "certificate", "analysis", "clearance", "tolerance"}));
    for (const auto& [key, value] : entries) {
      HULLD_RETURN_IF_ERROR(key == "pairs"    ? TakePairs(value)
                            : key == "movers" ? TakeMovers(value)
                                              : TakeQueryOption(key, value));
    }
    if (scene_.pairs.has_value() && !scene_.movers.empty()) {
      return yaml_.ErrorAt(node, "ask: pairs and movers cannot be combined");
    }
    return absl::OkStatus();
  }

  absl::Status TakePairs(const YAML::Node& node) {
    if (!node.IsSequence()) {
      return yaml_.ErrorAt(node, "pairs must be a list of pairs, as in [[a, b]]");
    }
    scene_.pairs.emplace();
    for (const YAML::Node& entry : node) {
      HULLD_ASSIGN_OR_RETURN(const auto names, TwoNames(entry, "pairs"));
      int side[2] = {0, 0};
      for (size_t i = 0; i < 2; ++i) {
        HULLD_ASSIGN_OR_RETURN(side[i], Find(entry[i], names[i], places_, "placement", "place"));
      }
      scene_.pairs->emplace_back(side[0], side[1]);
    }
    return absl::OkStatus();
  }

  absl::Status TakeMovers(const YAML::Node& node) {
    HULLD_ASSIGN_OR_RETURN(const auto names, yaml_.Texts(node, "movers"));
    for (size_t i = 0; i < names.size(); ++i) {
      HULLD_ASSIGN_OR_RETURN(const auto place,
                             Find(node[i], names[i], places_, "placement", "place"));
      std::vector<int>& movers = scene_.movers;
      if (std::find(movers.begin(), movers.end(), place) == movers.end()) movers.push_back(place);
    }
    return absl::OkStatus();
  }

  absl::Status TakeQueryOption(const std::string& key, const YAML::Node& node) {
    if (key == "max_error" || key == "clearance" || key == "tolerance") {
      HULLD_ASSIGN_OR_RETURN(const auto length, LengthOf(node, key));
      if (key == "tolerance") {
        scene_.tolerance = length;
      } else if (key == "clearance") {
        scene_.wanted.set_clearance(length);
      } else {
        scene_.wanted.set_max_error(length);
      }
      return absl::OkStatus();
    }
    HULLD_ASSIGN_OR_RETURN(const auto truth, yaml_.Truth(node, key));
    if (key == "axis") scene_.wanted.set_axis(truth);
    if (key == "separation") scene_.wanted.set_separation(truth);
    if (key == "witness") scene_.wanted.set_witness(truth);
    if (key == "normal") scene_.wanted.set_normal(truth);
    if (key == "certificate") scene_.wanted.set_certificate(truth);
    if (key == "analysis") scene_.wanted.set_analysis(truth);
    return absl::OkStatus();
  }

  const YamlReader& yaml_;
  const std::string file_;
  LengthScale scale_;
  SceneDescription scene_;
  std::map<std::string, std::string> hull_ids_;
  std::map<std::string, int> bodies_;
  std::map<std::string, int> places_;
  std::set<std::string> groups_;
  size_t pieces_ = 0;
};

// Exclusion of pairs in the form of the contract: a class for each placement outside of groups and
// for each group, and the ignored pairs of classes.
class Classes {
 public:
  explicit Classes(const SceneDescription& scene) {
    std::set<std::string> singled_out;
    for (const auto& [a, b] : scene.ignored) singled_out.insert({a, b});
    std::map<std::string, uint32_t> of_group;
    for (const PlacementDefinition& placement : scene.placements) {
      const bool alone = placement.group.empty() || singled_out.contains(placement.name);
      uint32_t number = next_;
      if (!alone) number = of_group.emplace(placement.group, next_).first->second;
      if (number == next_) ++next_;
      class_.push_back(number);
      members_[placement.name].insert(number);
      if (!placement.group.empty()) members_[placement.group].insert(number);
      if (!placement.group.empty()) groups_.insert(placement.group);
    }
    for (const std::string& group : groups_) Ignore(group, group);
    for (const auto& [a, b] : scene.ignored) Ignore(a, b);
  }

  uint32_t of(size_t placement) const { return class_[placement]; }
  const std::set<std::pair<uint32_t, uint32_t>>& ignored() const { return ignored_; }

 private:
  void Ignore(const std::string& a, const std::string& b) {
    for (const uint32_t one : members_[a]) {
      for (const uint32_t other : members_[b]) {
        if (one != other) ignored_.insert({std::min(one, other), std::max(one, other)});
      }
    }
  }

  uint32_t next_ = 0;
  std::vector<uint32_t> class_;
  std::map<std::string, std::set<uint32_t>> members_;
  std::set<std::string> groups_;
  std::set<std::pair<uint32_t, uint32_t>> ignored_;
};

v1::Pose PoseMessage(const RigidPose& X_WP) {
  v1::Pose pose = PoseOf(X_WP);
  // (w, 0, 0, 0) is the rotation of an absent quaternion, but its length matters in a motion.
  if (std::equal(kNoMotion.begin(), kNoMotion.begin() + 4, X_WP.begin())) pose.clear_rotation();
  return pose;
}

v1::Placement PlacementAt(const std::string& id, const RigidPose& X_WP, double radius) {
  v1::Placement placement;
  placement.set_hull_id(id);
  placement.set_radius(radius);
  if (X_WP != kNoMotion) *placement.mutable_pose() = PoseMessage(X_WP);
  return placement;
}

// Adds a placement, or the pieces of a divided body; returns their indices.
std::vector<uint32_t> AddPlacement(const SceneDescription& from,
                                   const PlacementDefinition& placement, BodyForm form,
                                   Scene* scene) {
  const auto add = [&](const std::string& name, const std::string& id, const RigidPose& X_OP,
                       double radius, int body) {
    v1::Placement& added = *scene->request.add_placements();
    const auto placed = [&](const RigidPose& X_WO) {
      return X_OP == kNoMotion ? X_WO : Compose(X_WO, X_OP);
    };
    added = PlacementAt(id, placed(placement.X_WO), radius);
    if (placement.X_WO_end) *added.mutable_end_pose() = PoseMessage(placed(*placement.X_WO_end));
    scene->names.push_back(name);
    scene->body_of.push_back(body);
    return scene->size() - 1;
  };
  if (placement.body < 0) {
    return {add(placement.name, placement.hull_id, kNoMotion, placement.radius, -1)};
  }
  const BodyDefinition& body = from.bodies[static_cast<size_t>(placement.body)];
  if (form == BodyForm::kWhole) {
    return {add(placement.name, body.body_id, kNoMotion, placement.radius, placement.body)};
  }
  std::vector<uint32_t> indices;
  for (const PieceDefinition& piece : body.pieces) {
    indices.push_back(add(absl::StrCat(placement.name, "/", piece.name), piece.hull_id, piece.X_BP,
                          placement.radius + piece.radius, -1));
  }
  return indices;
}

}  // namespace

v1::PutBodyRequest BodyRequest(const BodyDefinition& body) {
  v1::PutBodyRequest request;
  request.set_body_id(body.body_id);
  for (const PieceDefinition& piece : body.pieces) {
    *request.add_pieces() = PlacementAt(piece.hull_id, piece.X_BP, piece.radius);
  }
  return request;
}

absl::StatusOr<SceneDescription> ParseYamlScene(const std::string& text, const std::string& name) {
  HULLD_ASSIGN_OR_RETURN(const auto yaml, YamlReader::Parse(text, name));
  return SceneParser(yaml, name).Run();
}

absl::StatusOr<SceneDescription> ReadYamlScene(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const auto text, ReadText(path));
  return ParseYamlScene(text, path);
}

absl::StatusOr<Scene> ToScene(const SceneDescription& description, const std::string& name,
                              BodyForm form) {
  Scene scene;
  for (const BodyDefinition& body : description.bodies) {
    std::vector<std::string>& names = scene.piece_names.emplace_back();
    for (const PieceDefinition& piece : body.pieces) names.push_back(piece.name);
    scene.defined_ids.insert(body.body_id);
  }
  for (const HullDefinition& hull : description.hulls) scene.defined_ids.insert(hull.hull_id);
  const Classes classes(description);
  const size_t count = description.placements.size();
  std::vector<size_t> order(description.movers.begin(), description.movers.end());
  const std::set<size_t> first(order.begin(), order.end());
  for (size_t i = 0; i < count; ++i) {
    if (!first.contains(i)) order.push_back(i);
  }
  // Request indices of each placement.
  std::vector<std::vector<uint32_t>> placed(count);
  uint32_t movers = 0;
  for (const size_t i : order) {
    placed[i] = AddPlacement(description, description.placements[i], form, &scene);
    scene.request.mutable_groups()->Resize(static_cast<int>(scene.size()), classes.of(i));
    if (first.contains(i)) movers = scene.size();
  }
  if (!first.empty()) scene.request.set_movers(movers);
  // Refused without groups, which a scene without placements has none of.
  scene.request.set_ignore_same_group(count > 0);
  for (const auto& [a, b] : classes.ignored()) {
    scene.request.add_ignored_group_pairs(a);
    scene.request.add_ignored_group_pairs(b);
  }
  *scene.request.mutable_wanted() = description.wanted;
  scene.request.set_tolerance(description.tolerance);
  if (!description.pairs.has_value()) return scene;
  scene.pairs.emplace();
  for (const auto& [a, b] : *description.pairs) {
    for (const uint32_t one : placed[static_cast<size_t>(a)]) {
      for (const uint32_t other : placed[static_cast<size_t>(b)]) {
        if (scene.pairs->size() >= 2 * kMaxPairs) {
          return absl::InvalidArgumentError(
              absl::StrCat(name, ": more than ", kMaxPairs, " pairs are named"));
        }
        scene.pairs->insert(scene.pairs->end(), {one, other});
      }
    }
  }
  return scene;
}

}  // namespace hulld
