#include "client/hullctl/scene/scene_file.h"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>

#include <algorithm>
#include <cctype>
#include <numeric>
#include <span>
#include <string_view>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/scene/yaml_scene.h"
#include "client/packed_placements.h"
#include "client/pose/rigid_pose.h"

namespace hulld {
namespace {

// Scans an object in JSON or YAML flow style incrementally to find its end and the names of its
// direct members. The parser validates it.
class ObjectScanner {
 public:
  void Take(std::string_view piece) {
    for (const char c : piece) TakeLetter(c);
  }
  bool complete() const { return begun_ && depth_ == 0; }
  bool has(const char* name) const { return members_.contains(name); }

 private:
  void TakeLetter(char c) {
    if (in_text_) {
      if (escaped_) {
        escaped_ = false;
      } else if (c == '\\') {
        escaped_ = true;
      } else if (c == '"') {
        in_text_ = false;
        return;
      }
      text_ += c;
      return;
    }
    switch (c) {
      case '"':
        in_text_ = true;
        text_.clear();
        break;
      case '{':
      case '[':
        ++depth_;
        begun_ = true;
        text_.clear();
        break;
      case '}':
      case ']':
        --depth_;
        break;
      case ':':
        if (depth_ == 1) members_.insert(text_);
        break;
      case ',':
        text_.clear();
        break;
      default:
        // YAML does not require quotes around keys.
        if (std::isspace(static_cast<unsigned char>(c)) == 0) text_ += c;
        break;
    }
  }

  std::set<std::string> members_;
  std::string text_;
  int depth_ = 0;
  bool begun_ = false;
  bool in_text_ = false;
  bool escaped_ = false;
};

// Moves the fields with the same name in both messages.
template <typename Message>
void TakeShared(Message* from, Scene* scene) {
  v1::FindCollisionsRequest& request = scene->request;
  request.mutable_placements()->Swap(from->mutable_placements());
  if (from->has_packed_placements()) {
    request.mutable_packed_placements()->Swap(from->mutable_packed_placements());
  }
  if (from->has_wanted()) *request.mutable_wanted() = from->wanted();
  request.set_tolerance(from->tolerance());
  if (from->pairs_size() > 0) {
    scene->pairs.emplace(from->pairs().begin(), from->pairs().end());
  }
}

// Checks that the lists of packed placements match.
absl::Status CheckPacked(const v1::FindCollisionsRequest& request) {
  const v1::PackedPlacements& packed = request.packed_placements();
  if (request.has_packed_placements() && request.placements_size() > 0) {
    return absl::InvalidArgumentError("give placements or packedPlacements, not both");
  }
  if (packed.poses_size() != kPoseNumbers * packed.hulls_size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("packedPlacements.poses has ", packed.poses_size(), " numbers for ",
                     packed.hulls_size(), " placements; each needs seven"));
  }
  if (packed.radii_size() > 0 && packed.radii_size() != packed.hulls_size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("packedPlacements.radii has ", packed.radii_size(), " numbers for ",
                     packed.hulls_size(), " placements; give one for each, or none"));
  }
  if (packed.end_poses_size() > 0 && packed.end_poses_size() != packed.poses_size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("packedPlacements.endPoses has ", packed.end_poses_size(), " numbers for ",
                     packed.hulls_size(), " placements; give seven for each, or none"));
  }
  const int count = packed.hull_ids_size() + packed.shape_sizes_size();
  for (const uint32_t hull : packed.hulls()) {
    if (hull < static_cast<uint32_t>(count)) continue;
    return absl::InvalidArgumentError(absl::StrCat("packedPlacements.hulls names hull ", hull,
                                                   "; hullIds and shapeSizes hold ", count));
  }
  const uint64_t points =
      std::accumulate(packed.shape_sizes().begin(), packed.shape_sizes().end(), uint64_t{0});
  if (3 * points == static_cast<uint64_t>(packed.shape_points().xyz_size())) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "packedPlacements.shapeSizes add up to ", points, " points, but shapePoints.xyz has ",
      packed.shape_points().xyz_size(), " numbers; each point needs three"));
}

// Parses the object as the message that contains its members.
absl::StatusOr<Scene> ParseScene(const std::string& text, const ObjectScanner& scanner) {
  Scene scene;
  const bool names_pairs = scanner.has("pairs");
  if (scanner.has("onlyChanges") || scanner.has("only_changes")) {
    v1::CollisionStreamOpen open;
    if (absl::Status s = ParseJson(text, UnknownFields::kRefuse, &open); !s.ok()) return s;
    TakeShared(&open, &scene);
    scene.only_changes = open.only_changes();
  } else if (names_pairs || scanner.has("method")) {
    for (const char* name : {"groups", "ignoreSameGroup", "ignoredGroupPairs", "movers"}) {
      if (names_pairs && scanner.has(name)) {
        return absl::InvalidArgumentError(
            absl::StrCat("\"pairs\" and \"", name, "\" cannot be combined; remove one of them"));
      }
    }
    v1::BatchCheckCollisionsRequest batch;
    if (absl::Status s = ParseJson(text, UnknownFields::kRefuse, &batch); !s.ok()) return s;
    TakeShared(&batch, &scene);
    scene.method = batch.method();
  } else {
    HULLD_RETURN_IF_ERROR(ParseJson(text, UnknownFields::kRefuse, &scene.request));
  }
  HULLD_RETURN_IF_ERROR(CheckPacked(scene.request));
  if (scene.pairs.has_value() && scene.pairs->size() % 2 != 0) {
    return absl::InvalidArgumentError(absl::StrCat("pairs has an odd number of indices, ",
                                                   scene.pairs->size(), "; each pair needs two"));
  }
  for (const uint32_t index : scene.pairs.value_or(std::vector<uint32_t>())) {
    if (index < scene.size()) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("pairs names placement ", index, "; there are ", scene.size()));
  }
  return scene;
}

// Parses a YAML scene that starts at line `first_line` of the source.
absl::StatusOr<Scene> ParseYaml(const ByteSource& source, uint64_t first_line,
                                const std::string& text, BodyForm form) {
  // Preceding lines count in error positions.
  const std::string padded =
      absl::StrCat(std::string(static_cast<size_t>(first_line - 1), '\n'), text, "\n");
  HULLD_ASSIGN_OR_RETURN(const auto description, ParseYamlScene(padded, source.name()));
  return ToScene(description, source.name(), form);
}

// Reads an object: a scene in YAML, which includes JSON, or a request of the contract.
absl::StatusOr<Scene> ReadObject(ByteSource* source, std::string text, BodyForm form) {
  ObjectScanner scanner;
  scanner.Take(text);
  const uint64_t first_line = source->line();
  std::string_view line;
  while (!scanner.complete() && source->ReadLine(&line)) {
    absl::StrAppend(&text, "\n", absl::string_view(line.data(), line.size()));
    scanner.Take(line);
  }
  if (!source->status().ok()) return source->status();
  for (const char* key : kSceneKeys) {
    if (scanner.has(key)) return ParseYaml(*source, first_line, text, form);
  }
  absl::StatusOr<Scene> scene = ParseScene(text, scanner);
  if (scene.ok()) return scene;
  const std::string message(scene.status().message());
  if (source->line() == first_line) return source->ErrorAtLine(message);
  return absl::InvalidArgumentError(absl::StrCat(source->name(), ": ", message));
}

// Reads the rest of the source, after `first`, as one YAML document.
absl::StatusOr<Scene> ReadRestAsYaml(ByteSource* source, std::string_view first, BodyForm form) {
  const uint64_t first_line = source->line();
  std::string text(first);
  for (std::string_view line; source->ReadLine(&line);) text.append("\n").append(line);
  if (!source->status().ok()) return source->status();
  return ParseYaml(*source, first_line, text, form);
}

// Returns the YAML that replaces a line of the old line format, "place NAME HULL [POSE]", "pair
// NAME NAME", or "all". Empty for any other line.
std::string YamlForLine(std::string_view line) {
  std::vector<std::string> words;
  std::string_view rest = line.substr(0, line.find('#'));
  for (std::string_view word; !(word = NextToken(&rest)).empty();) words.emplace_back(word);
  if (words[0] == "all" && words.size() == 1) return "no \"ask: {pairs: ...}\"";
  if (words[0] == "pair" && words.size() == 3) {
    return absl::StrCat("\"ask: {pairs: [[", words[1], ", ", words[2], "]]}\"");
  }
  if (words[0] != "place" || words.size() < 3) return "";
  std::string at;
  if (words.size() > 3) {
    at = absl::StrCat(", at: [", absl::StrJoin(words.begin() + 3, words.end(), ", "), "]");
  }
  return absl::StrCat("\"place: {", words[1], ": {id: ", words[2], at, "}}\"");
}

// Decides which pairs of placements are excluded from queries.
class GroupRule {
 public:
  explicit GroupRule(const v1::FindCollisionsRequest& request) : request_(request) {
    for (int i = 0; i + 1 < request.ignored_group_pairs_size(); i += 2) {
      const uint32_t g = request.ignored_group_pairs(i);
      const uint32_t h = request.ignored_group_pairs(i + 1);
      ignored_.insert({std::min(g, h), std::max(g, h)});
    }
  }

  bool Ignores(uint32_t a, uint32_t b) const {
    if (request_.groups_size() == 0) return false;
    const uint32_t g = request_.groups(static_cast<int>(a));
    const uint32_t h = request_.groups(static_cast<int>(b));
    if (g == h && request_.ignore_same_group()) return true;
    return ignored_.contains({std::min(g, h), std::max(g, h)});
  }

 private:
  const v1::FindCollisionsRequest& request_;
  std::set<std::pair<uint32_t, uint32_t>> ignored_;
};

// Unpacks the pose of a placement.
v1::Pose PackedPose(const google::protobuf::RepeatedField<double>& poses, uint32_t placement) {
  return PoseOf(std::span<const double, 7>(poses.data() + ptrdiff_t{kPoseNumbers} * placement, 7));
}

}  // namespace

uint32_t Scene::size() const {
  const int packed = request.packed_placements().hulls_size();
  return static_cast<uint32_t>(packed > 0 ? packed : request.placements_size());
}

const std::string* Scene::HullOf(uint32_t placement) const {
  if (placement < static_cast<uint32_t>(request.placements_size())) {
    return &request.placements(static_cast<int>(placement)).hull_id();
  }
  const v1::PackedPlacements& packed = request.packed_placements();
  if (placement >= static_cast<uint32_t>(packed.hulls_size())) return nullptr;
  const uint32_t hull = packed.hulls(static_cast<int>(placement));
  static const std::string kShape;
  if (hull >= static_cast<uint32_t>(packed.hull_ids_size())) return &kShape;
  return &packed.hull_ids(static_cast<int>(hull));
}

v1::Placement Scene::PlacementOf(uint32_t placement) const {
  if (request.placements_size() > 0) return request.placements(static_cast<int>(placement));
  const v1::PackedPlacements& packed = request.packed_placements();
  const int shape =
      static_cast<int>(packed.hulls(static_cast<int>(placement))) - packed.hull_ids_size();
  v1::Placement result;
  if (shape < 0) {
    result.set_hull_id(*HullOf(placement));
  } else {
    const auto sizes = packed.shape_sizes().begin();
    const double* const points =
        packed.shape_points().xyz().data() + 3 * std::accumulate(sizes, sizes + shape, uint64_t{0});
    result.mutable_points()->mutable_xyz()->Add(points, points + 3 * size_t{sizes[shape]});
  }
  *result.mutable_pose() = PackedPose(packed.poses(), placement);
  if (!packed.end_poses().empty()) {
    *result.mutable_end_pose() = PackedPose(packed.end_poses(), placement);
  }
  if (packed.radii_size() > 0) result.set_radius(packed.radii(static_cast<int>(placement)));
  return result;
}

std::string Scene::NameOf(uint32_t placement) const {
  if (placement < names.size()) return names[placement];
  const std::string* const hull = HullOf(placement);
  if (hull == nullptr) return absl::StrCat(placement);
  const bool is_shape = hull->empty() && PlacementOf(placement).has_points();
  return absl::StrCat(placement, ":", is_shape ? "points" : *hull);
}

std::array<std::string, 2> Scene::NamesOfPieces(uint32_t a, uint32_t b,
                                                std::pair<int32_t, int32_t> pieces) const {
  const auto name = [this](uint32_t placement, int32_t piece) -> std::string {
    const int body = placement < body_of.size() ? body_of[placement] : -1;
    if (body < 0 || piece < 0) return "";
    // The server's body may differ from the file's.
    const std::vector<std::string>& named = piece_names[static_cast<size_t>(body)];
    return static_cast<size_t>(piece) < named.size() ? named[static_cast<size_t>(piece)] : "";
  };
  return {name(a, pieces.first), name(b, pieces.second)};
}

std::string Scene::InKeys(const std::string& message) const {
  if (names.empty()) return message;
  std::string text = absl::StrReplaceAll(message, {{"wanted.", "ask."},
                                                   {"an end_pose", "a \"to\""},
                                                   {"].end_pose is set", "] has a \"to\""},
                                                   {"end_pose", "\"to\""},
                                                   {"METHOD_TEXTBOOK_SAT", "--textbook"},
                                                   {"first_only", "--first"},
                                                   {"every_piece", "--every-piece"},
                                                   {"and limit ", "and --nearest "},
                                                   {"use CheckCollision, BatchCheckCollisions, or "
                                                    "FindCollisions",
                                                    "use 'hullctl batch' or 'hullctl scene'"}});
  // Updates of a stream have placements of their own.
  const size_t at = text.starts_with("open: ") ? 6 : 0;
  constexpr std::string_view kPlacements = "placements[";
  const size_t begin = at + kPlacements.size();
  const size_t end = text.find(']');
  uint32_t index = 0;
  if (text.compare(at, kPlacements.size(), kPlacements) == 0 && end != std::string::npos &&
      absl::SimpleAtoi(text.substr(begin, end - begin), &index) && index < names.size()) {
    text.replace(at, end + 1 - at, "placement " + names[index]);
  }
  return text;
}

absl::Status Scene::InKeys(const absl::Status& status) const {
  if (status.ok()) return status;
  absl::Status renamed(status.code(), InKeys(std::string(status.message())));
  status.ForEachPayload([&renamed](absl::string_view type, const absl::Cord& payload) {
    renamed.SetPayload(type, payload);
  });
  return renamed;
}

std::string Scene::ProblemText(uint32_t placement, const v1::PlacementProblem& problem) const {
  const std::string* const id = HullOf(placement);
  const bool is_missing = problem.code() == static_cast<int>(absl::StatusCode::kNotFound);
  const bool is_defined = id != nullptr && defined_ids.contains(*id);
  return absl::StrCat(InKeys(problem.message()),
                      is_missing && is_defined ? "; 'hullctl scene apply' creates it" : "");
}

absl::StatusOr<Scene> ReadScene(ByteSource* source, BodyForm form) {
  for (std::string_view line; source->ReadLine(&line);) {
    const std::string_view trimmed = Trim(line);
    if (trimmed.empty() || trimmed.front() == '#') continue;
    if (trimmed.front() == '{') return ReadObject(source, std::string(line), form);
    const std::string yaml = YamlForLine(trimmed);
    if (yaml.empty()) return ReadRestAsYaml(source, line, form);
    return source->ErrorAtLine(absl::StrCat("a scene is YAML, not lines of place and pair; write ",
                                            yaml, "; --help shows an example"));
  }
  if (!source->status().ok()) return source->status();
  return absl::InvalidArgumentError(
      absl::StrCat(source->name(), " contains no scene; --help shows an example"));
}

absl::StatusOr<std::vector<uint32_t>> PairsOf(const Scene& scene, const std::string& file) {
  if (scene.pairs.has_value()) return *scene.pairs;
  const v1::FindCollisionsRequest& request = scene.request;
  const uint64_t n = scene.size();
  const auto problem = [&file](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": ", what));
  };
  if (request.groups_size() != 0 && static_cast<uint64_t>(request.groups_size()) != n) {
    return problem(
        absl::StrCat("groups has ", request.groups_size(), " groups for ", n, " placements"));
  }
  // A pair needs at least one mover; if it has one, its lower index is a mover.
  const uint64_t movers = request.has_movers() ? std::min<uint64_t>(request.movers(), n) : n;
  const std::string too_many =
      absl::StrCat("more than ", kMaxPairs,
                   " pairs; split the file, or use 'hullctl scene' to find colliding pairs");
  // Groups may exclude most pairs, but each pair must be examined.
  constexpr uint64_t kMaxLooks = uint64_t{16} * kMaxPairs;
  if (movers * n > kMaxLooks) return problem(too_many);
  const GroupRule rule(request);
  std::vector<uint32_t> pairs;
  for (uint32_t a = 0; a < movers; ++a) {
    for (uint32_t b = a + 1; b < n; ++b) {
      if (rule.Ignores(a, b)) continue;
      if (pairs.size() >= 2 * kMaxPairs) return problem(too_many);
      pairs.insert(pairs.end(), {a, b});
    }
  }
  if (pairs.empty()) return problem("no pairs to check");
  return pairs;
}

absl::StatusOr<Scene> ReadWholeScene(const std::string& path, const std::string& command,
                                     BodyForm form) {
  HULLD_ASSIGN_OR_RETURN(const auto source, ByteSource::Open(path));
  HULLD_ASSIGN_OR_RETURN(auto scene, ReadScene(source.get(), form));
  for (std::string_view line; source->ReadLine(&line);) {
    if (Trim(line).empty()) continue;
    return source->ErrorAtLine(absl::StrCat(
        "'hullctl ", command, "' does not accept updates after the scene; use 'hullctl stream'"));
  }
  HULLD_RETURN_IF_ERROR(source->status());
  return scene;
}

}  // namespace hulld
