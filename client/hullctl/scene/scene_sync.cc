#include "client/hullctl/scene/scene_sync.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <bit>
#include <set>

#include "client/base/status_macros.h"
#include "client/enclosure/convex_region.h"
#include "client/formats/point_file.h"
#include "client/hullctl/scene/yaml_scene.h"
#include "client/packed_placements.h"

namespace hulld {
namespace {

absl::StatusOr<std::vector<double>> ReadFile(const HullDefinition& hull) {
  HULLD_ASSIGN_OR_RETURN(const PointFormat format, PointFormatOfPath(hull.file));
  ReadRequest request{hull.file, format, {}, {}};
  request.options.scale.fill(hull.scale);
  return ReadAllPoints(request);
}

std::array<uint64_t, 7> BitsOf(const v1::Pose& pose) {
  return std::bit_cast<std::array<uint64_t, 7>>(NumbersOf(pose));
}

}  // namespace

absl::StatusOr<std::vector<double>> PointsOf(const HullDefinition& hull) {
  if (hull.file.empty()) return hull.xyz;
  auto xyz = ReadFile(hull);
  if (xyz.ok()) return xyz;
  return absl::InvalidArgumentError(absl::StrCat(hull.where, ": ", xyz.status().message()));
}

absl::StatusOr<Change> Compare(const Client& client, const std::string& hull_id,
                               const std::vector<double>& xyz) {
  const auto mesh = client.GetHullMesh(hull_id);
  if (absl::IsNotFound(mesh.status())) return Change::kCreate;
  if (!mesh.ok()) return mesh.status();
  HULLD_ASSIGN_OR_RETURN(const auto same, IsHullOf(*mesh, xyz));
  return same ? Change::kNone : Change::kReplace;
}

absl::StatusOr<Change> CompareBody(const Client& client, const BodyDefinition& body) {
  const auto found = client.GetBody(body.body_id);
  if (absl::IsNotFound(found.status())) return Change::kCreate;
  // Replacing a damaged hull repairs it.
  if (absl::IsDataLoss(found.status())) return Change::kReplace;
  if (!found.ok()) return found.status();
  const v1::PutBodyRequest defined = BodyRequest(body);
  const bool same =
      std::equal(defined.pieces().begin(), defined.pieces().end(), found->pieces().begin(),
                 found->pieces().end(), [](const v1::Placement& a, const v1::Placement& b) {
                   return a.hull_id() == b.hull_id() && BitsOf(a.pose()) == BitsOf(b.pose()) &&
                          a.radius() == b.radius();
                 });
  return same ? Change::kNone : Change::kReplace;
}

absl::Status PutSceneIfLocal(const Invocation& run, const std::string& path) {
  if (!run.local || path == "-") return absl::OkStatus();
  const auto scene = ReadYamlScene(path);
  // The command itself reports errors of the file.
  if (!scene.ok()) return absl::OkStatus();
  const Client client = run.MakeClient();
  for (const HullDefinition& hull : scene->hulls) {
    HULLD_ASSIGN_OR_RETURN(const auto xyz, PointsOf(hull));
    HULLD_RETURN_IF_ERROR(client.PutHull(hull.hull_id, xyz));
  }
  for (const BodyDefinition& body : scene->bodies) {
    HULLD_RETURN_IF_ERROR(client.PutBody(BodyRequest(body)).status());
  }
  return absl::OkStatus();
}

bool OwnsItsPrefix(const SceneDescription& scene) { return scene.prefix.ends_with('/'); }

absl::StatusOr<std::vector<ServerObject>> UnlistedObjects(const Client& client,
                                                          const SceneDescription& scene) {
  std::vector<ServerObject> unlisted;
  if (!OwnsItsPrefix(scene)) return unlisted;
  const auto add = [&unlisted](const std::string& id, bool is_body, const auto& info) {
    std::optional<uint64_t> revision;
    if (!info.damaged()) revision = info.revision();
    unlisted.push_back({id, is_body, revision});
  };
  std::set<std::string> defined_bodies;
  for (const BodyDefinition& body : scene.bodies) defined_bodies.insert(body.body_id);
  HULLD_ASSIGN_OR_RETURN(const auto bodies, client.ListAllBodies(scene.prefix));
  for (const v1::BodyInfo& body : bodies.bodies()) {
    if (!defined_bodies.contains(body.body_id())) add(body.body_id(), true, body);
  }
  std::set<std::string> defined;
  for (const HullDefinition& hull : scene.hulls) defined.insert(hull.hull_id);
  HULLD_ASSIGN_OR_RETURN(const auto list, client.ListAllHulls(scene.prefix));
  for (const v1::HullInfo& hull : list.hulls()) {
    if (!defined.contains(hull.hull_id())) add(hull.hull_id(), false, hull);
  }
  return unlisted;
}

}  // namespace hulld
