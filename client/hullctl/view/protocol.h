#ifndef HULLD_CLIENT_HULLCTL_VIEW_PROTOCOL_H_
#define HULLD_CLIENT_HULLCTL_VIEW_PROTOCOL_H_

#include <absl/status/statusor.h>
#include <google/protobuf/struct.pb.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// What the page and the bridge tell each other over one WebSocket. The page's side is
// page/connection.js. Small messages are JSON objects with a member "type"; members that come from
// the contract follow the JSON mapping of proto3 (64-bit integers are strings, "Infinity" is a
// string). Doubles are written so that they read back as the same numbers; JSON has no sign of
// zero. Geometry is binary.
//
// The page to the bridge:
//   show       {key}: shows a scene of `hello`. The bridge answers with `scene`.
//   geometry   {hullIds, files}: asks for hulls and bodies by ID and files by index; a frame
//   answers
//              each. From then on `hull` tells of what is asked for, as of objects.
//   simplify   {hullId, side: "inside"|"outside", maxError, maxVertices}: a frame answers it.
//   question   {scene, update, objects, poses, pair, tolerance, certificate, rest}: of the scene of
//              that number, the new poses of some objects (seven numbers each, as in Pose), the
//              pair to tell all about (two indices, or none), the tolerance of the scene, whether
//              the pair's certificate is wanted, and whether nothing moves now. While a question
//              waits, the next one takes its place, its poses added. `answer` and `collisions`
//              answer it.
//   edit       {action: "append"|"delete", hullId, points}: changes a hull; `points` are three
//              numbers each. Refused unless `hello` says that the page may. `edited` answers it;
//              while edits of one hull wait, one answer may be that of several.
//
// The bridge to the page:
//   hello      {server, version, up, edit, scenes: [{key, title}]}, first; edit: whether the page
//              may change hulls.
//   scene      {number, key, title, note, files: [{name}], objects: [OBJECT]}: forget what was
//              there. OBJECT is {name, hullId, file, pose}: hullId is that of a hull or a body;
//              it is "" and file -1 where there is none. Other messages name objects and files by
//              their index here.
//   objects    {scene, objects}: more objects of that scene, behind those that are there.
//   hull       {event}: a HullEvent of the contract: a hull or a body changed, appeared or went.
//   answer     {update, rest, pair, poses, hullA, hullB, relation, rung, axis, certificate,
//              separation, witness, pieces, tolerant} or {update, pair, problem}: of the pair that
//              was asked for; with a body, of the pieces that decided. At rest this is what
//              CheckCollision says, otherwise what StreamCollisions says. tolerant, at rest and
//              with a tolerance: {tolerance, relation, rung}, what CheckCollision says with it.
//   collisions {update, revision, pairs: [[a, b, relation]], problems: [text], totals}: all pairs
//              of the scene that collide (FindCollisions), a < b.
//   edited     {hullId, done, message}: how an edit ended; message is for people.
//   problem    {message}: something failed; for people.
//
// A frame is, little-endian: the length of its head (uint32), its head (JSON), zeros up to a
// multiple of 8 bytes, doubles (x y z of each vertex), then uint32s. Heads:
//   {kind: "hull", hullId, header: MeshHeader, vertices, facets, indices}: the vertices, then the
//              sizes of the facets and the vertex indices of all of them.
//   {kind: "body", hullId, info: BodyInfo, pieces: [{hullId, pose}]}: no numbers follow; the page
//              asks for the hulls of the pieces.
//   {kind: "simplified", hullId, side, ...the same}: the same for a simplification.
//   {kind: "mesh", file, vertices, triangles, points}: the vertices and three indices for each
//              triangle; `points` counts all points of the file, of which only some may be here.
//   {kind: "missing", hullId | file, message}: there is none.
//
// A recording, for a page without a bridge, is {hello, scene, frames: [base64], collisions,
// answers: [answer]}.

// A message of the page, understood.
struct ViewQuestion {
  uint64_t scene = 0;
  uint64_t update = 0;
  std::vector<uint32_t> objects;
  std::vector<Pose7> poses;
  std::optional<std::pair<uint32_t, uint32_t>> pair;
  double tolerance = 0;
  bool certificate = false;
  bool rest = false;
};
struct GeometryWish {
  // One of the three; the first may be a body's.
  std::optional<std::string> hull_id;
  std::optional<uint32_t> file;
  std::optional<v1::GetHullMeshRequest> simplified;
};
struct ViewEdit {
  enum class Action { kAppend, kDelete };
  Action action = Action::kAppend;
  std::string hull_id;
  // x y z of each point to append.
  std::vector<double> points;
};
struct PageMessage {
  std::optional<std::string> show;
  std::vector<GeometryWish> geometry;
  std::optional<ViewQuestion> question;
  std::optional<ViewEdit> edit;
};

// INVALID_ARGUMENT: what is wrong with it.
absl::StatusOr<PageMessage> ParsePageMessage(std::string_view json);

// One text message for the page: its type, then members that are JSON already.
std::string TextMessage(const std::string& type,
                        const std::vector<std::pair<std::string, std::string>>& members);

std::string ProblemMessage(const std::string& message);
std::string ObjectsJson(const std::vector<ViewObject>& objects, size_t from = 0);
// `number` counts the scenes that the page was shown.
std::string SceneMessage(const ViewScene& scene, uint64_t number);

// Frames.
std::string HullFrame(const std::string& hull_id, const HullMesh& mesh);
std::string BodyFrame(const v1::GetBodyResponse& body);
std::string SimplifiedFrame(const v1::GetHullMeshRequest& request, const HullMesh& mesh);
std::string MeshFrame(uint32_t file, const FileShape& shape);
std::string MissingFrame(const GeometryWish& wish, const std::string& message);

// "[1,2.5]": numbers that read back as the same doubles. Requires finite ones; others become null.
std::string NumbersJson(const double* numbers, size_t count);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_PROTOCOL_H_
