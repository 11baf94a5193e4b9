#include "client/hullctl/scene/scene_sync.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <set>
#include <utility>

#include "client/enclosure/convex_region.h"
#include "client/formats/point_file.h"
#include "client/hullctl/body/body_pieces.h"
#include "client/hullctl/scene/yaml_scene.h"
#include "client/point_messages.h"

namespace hulld {
namespace {

absl::StatusOr<std::vector<double>> ReadFile(const HullDefinition& hull) {
  const auto format = PointFormatOfPath(hull.file);
  if (!format.ok()) return format.status();
  std::vector<double> xyz;
  ReadRequest request{hull.file, *format, {}, {}};
  request.options.scale.fill(hull.scale);
  const auto counts = ReadPoints(request, [&](const PointChunk& block) {
    xyz.insert(xyz.end(), block.xyz.begin(), block.xyz.end());
    xyz.insert(xyz.end(), block.xyz_float.begin(), block.xyz_float.end());
    return absl::OkStatus();
  });
  if (!counts.ok()) return counts.status();
  return xyz;
}

std::array<uint64_t, 7> BitsOf(const v1::Pose& pose) {
  return std::bit_cast<std::array<uint64_t, 7>>(NumbersOf(pose));
}

}  // namespace

absl::StatusOr<std::vector<double>> PointsOf(const HullDefinition& hull) {
  if (hull.file.empty()) return hull.xyz;
  auto xyz = ReadFile(hull);
  if (xyz.ok()) return xyz;
  const std::string message(xyz.status().message().data(), xyz.status().message().size());
  return absl::InvalidArgumentError(absl::StrCat(hull.where, ": ", message));
}

absl::StatusOr<Change> Compare(const Client& client, const std::string& hull_id,
                               const std::vector<double>& xyz) {
  const auto mesh = client.GetHullMesh(hull_id);
  if (absl::IsNotFound(mesh.status())) return Change::kCreate;
  if (!mesh.ok()) return mesh.status();
  const auto same = IsHullOf(*mesh, xyz);
  if (!same.ok()) return same.status();
  return *same ? Change::kNone : Change::kReplace;
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

absl::Status PutHull(const Client& client, const std::string& hull_id,
                     const std::vector<double>& xyz) {
  v1::ReplaceOpen open;
  open.set_hull_id(hull_id);
  open.set_create_if_absent(true);
  const auto feed = [&xyz](const Client::PointSink& sink) { return SendInMessages(xyz, sink); };
  return client.ReplaceHull(open, feed).status();
}

absl::Status PutAll(const Client& client, const SceneDescription& scene) {
  for (const HullDefinition& hull : scene.hulls) {
    const auto xyz = PointsOf(hull);
    if (!xyz.ok()) return xyz.status();
    if (absl::Status put = PutHull(client, hull.hull_id, *xyz); !put.ok()) return put;
  }
  for (const BodyDefinition& body : scene.bodies) {
    if (absl::Status put = client.PutBody(BodyRequest(body)).status(); !put.ok()) return put;
  }
  return absl::OkStatus();
}

bool OwnsItsPrefix(const SceneDescription& scene) { return scene.prefix.ends_with('/'); }

absl::StatusOr<std::vector<Kept>> Strangers(const Client& client, const SceneDescription& scene) {
  std::vector<Kept> strangers;
  if (!OwnsItsPrefix(scene)) return strangers;
  const auto add = [&strangers](const std::string& id, bool is_body, const auto& info) {
    std::optional<uint64_t> revision;
    if (!info.damaged()) revision = info.revision();
    strangers.push_back({id, is_body, revision});
  };
  std::set<std::string> defined_bodies;
  for (const BodyDefinition& body : scene.bodies) defined_bodies.insert(body.body_id);
  const auto bodies = client.ListAllBodies(scene.prefix);
  if (!bodies.ok()) return bodies.status();
  for (const v1::BodyInfo& body : bodies->bodies()) {
    if (!defined_bodies.contains(body.body_id())) add(body.body_id(), true, body);
  }
  std::set<std::string> defined;
  for (const HullDefinition& hull : scene.hulls) defined.insert(hull.hull_id);
  const auto list = client.ListAllHulls(scene.prefix);
  if (!list.ok()) return list.status();
  for (const v1::HullInfo& hull : list->hulls()) {
    if (!defined.contains(hull.hull_id())) add(hull.hull_id(), false, hull);
  }
  return strangers;
}

}  // namespace hulld
