#ifndef HULLD_CLIENT_HULLCTL_VIEW_PROTOCOL_H_
#define HULLD_CLIENT_HULLCTL_VIEW_PROTOCOL_H_

#include <absl/status/statusor.h>
#include <google/protobuf/struct.pb.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// Messages between the page and the bridge over one WebSocket. The page's side is
// page/connection.js. Small messages are JSON objects with a member "type"; members from the
// contract follow the JSON mapping of proto3 (64-bit integers are strings, "Infinity" is a string).
// Doubles read back as the same numbers; JSON has no sign of zero. Geometry is binary.
//
// The page to the bridge:
//   show       {key}: shows a scene of `hello`. The bridge answers with `scene`.
//   geometry   {hullIds, files}: requests hulls and bodies by ID and files by index; one frame
//              answers each. From then on `hull` reports their changes, as for objects.
//   simplify   {hullId, side: "inside"|"outside", maxError, maxVertices}: a frame answers it.
//   query   {scene, update, objects, poses, time, pair, tolerance, certificate, rest}: for scene
//              number `scene`: new poses of some objects (seven numbers each, as in Pose), the time
//              of these poses in a scene with motions, the pair to report in detail (two indices,
//              or none), the scene's tolerance, true if the pair's certificate is wanted, and true
//              if nothing moves now. A new query replaces the pending one and keeps its poses.
//              `answer`, `motion`, and `collisions` answer it.
//   joints     {scene, values, waypoint}: moves the joints of the scene; waypoint: the index of the
//              waypoint with these values, or null. `poses` answers it.
//
// The bridge to the page:
//   hello      {server, version, up, scenes: [{key, title}]}, first.
//   scene      {number, key, title, note, files: [{name}], objects: [OBJECT], joints: [{name, low,
//              high, value}], waypoints: [values], contacts, named, watch}: replaces all previous
//              content.
//              OBJECT is {name, hullId, file, pose, radius, isJointed, endPose}: hullId is that of
//              a hull or a body, "" if absent; file is -1 if absent; isJointed: moved by the joints
//              only; endPose: the end of its motion, null if it has none. Later messages name
//              objects and files by their index here. contacts: the waypoints with a colliding
//              pair. named: the first pair that the file names; empty if it names none. watch: the
//              messages of a recorded watch, as in the contract; empty if there is none.
//              Placements are objects. `collisions` is ignored with a watch of pairs, `hull` with
//              one of hulls.
//   objects    {scene, objects}: appends objects to that scene.
//   hull       {event}: a HullEvent of the contract: a hull or a body changed, appeared, or was
//              deleted.
//   answer     {update, rest, pair, poses, hullA, hullB, relation, rung, axis, certificate,
//              separation, witness, pieces, tolerant} or {update, pair, problem}: for the requested
//              pair; with a body, for the deciding pieces. The result of CheckCollision at rest, of
//              StreamCollisions otherwise. tolerant, at rest and with a tolerance:
//              {tolerance, relation, rung}, the result of CheckCollision with it.
//   motion     {update, pair, poses, hulls, relation, firstContact, certificate,
//              pieceCertificates} or {update, pair, problem}: for the requested pair, if it moves:
//              the result of CheckCollision for the motions from `poses` to the end. hulls: the
//              versions of hulls, bodies, and pieces that it concerns. Not repeated while it stays
//              the same.
//   collisions {update, revision, pairs: [[a, b, relation]], problems: [text], totals}: all pairs
//              of the scene that collide (FindCollisions), or all named pairs that do, a < b.
//   poses      {scene, poses}: of all jointed objects, seven numbers each.
//   problem    {message}: an error, for people.
//
// A frame is, little-endian: the length of its head (uint32), its head (JSON), zeros up to a
// multiple of 8 bytes, doubles (x y z of each vertex), then uint32s. Heads:
//   {kind: "hull", hullId, header: MeshHeader, vertices, facets, indices}: the vertices, then the
//              sizes of the facets and the vertex indices of all of them.
//   {kind: "body", hullId, info: BodyInfo, pieces: [{hullId, pose}]}: no numbers follow; the page
//              requests the hulls of the pieces.
//   {kind: "simplified", hullId, side, ...the same}: as "hull", for a simplification.
//   {kind: "mesh", file, vertices, triangles, points}: the vertices and three indices for each
//              triangle; `points` counts all points of the file, of which the frame may contain a
//              part.
//   {kind: "missing", hullId | file, message}: it does not exist.
//
// A recording, for a page without a bridge, is {hello, scene, frames: [base64], motions: [motion],
// states: [{time, poses, collisions, answers: [answer]}]}: the state at the start, at each
// waypoint, or at several times of the motions, among them all contact times.

// A parsed message of the page.
struct ViewQuery {
  uint64_t scene = 0;
  uint64_t update = 0;
  std::vector<uint32_t> objects;
  std::vector<RigidPose> poses;
  std::optional<std::pair<uint32_t, uint32_t>> pair;
  double tolerance = 0;
  bool certificate = false;
  bool rest = false;
};
struct ShapeRequest {
  // Exactly one of the three is set; the first may be a body's.
  std::optional<std::string> hull_id;
  std::optional<uint32_t> file;
  std::optional<v1::GetHullMeshRequest> simplified;
};
struct ViewConfiguration {
  uint64_t scene = 0;
  std::vector<double> values;
};
struct PageMessage {
  std::optional<std::string> show;
  std::vector<ShapeRequest> geometry;
  std::optional<ViewQuery> query;
  std::optional<ViewConfiguration> joints;
};

// INVALID_ARGUMENT names the defect.
absl::StatusOr<PageMessage> ParsePageMessage(std::string_view json);

// Returns one text message for the page: its type, then members that are already JSON.
std::string TextMessage(const std::string& type,
                        const std::vector<std::pair<std::string, std::string>>& members);

std::string ProblemMessage(const std::string& message);
std::string ObjectsJson(const std::vector<ViewObject>& objects);
// `number` counts the scenes shown to the page.
std::string SceneMessage(const ViewScene& scene, uint64_t number);

// Returns the numbers of poses, one after the other.
std::string PosesJson(const std::vector<RigidPose>& poses);

// Return frames.
std::string HullFrame(const std::string& hull_id, const HullMesh& mesh);
std::string BodyFrame(const v1::GetBodyResponse& body);
std::string SimplifiedFrame(const v1::GetHullMeshRequest& request, const HullMesh& mesh);
std::string MeshFrame(uint32_t file, const FileShape& shape);
std::string MissingFrame(const ShapeRequest& shape, const std::string& message);

// Returns "[1,2.5]": numbers that read back as the same doubles. Infinities and NaN become null.
std::string NumbersJson(std::span<const double> numbers);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_PROTOCOL_H_
