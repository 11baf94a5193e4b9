// Bodies: reads return the pieces put, and answers follow from the pieces.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>

#include "client/verify/piece_check.h"
#include "tests/fuzz/service/service_program.h"

namespace hulld::fuzz {
namespace {

using server::Rpc;

// The limit of a batch.
constexpr int kMaxComparedPairs = 60;

// Returns the rank of a relation among those of pieces.
int Strength(v1::Relation relation) {
  return relation == v1::RELATION_OVERLAPPING ? 2 : relation == v1::RELATION_TOUCHING ? 1 : 0;
}

// Returns a piece with its pose as text; a missing rotation or translation equals the identity.
std::string Text(const v1::Placement& piece) {
  const v1::Vector3& t = piece.pose().translation();
  return absl::StrCat(piece.hull_id(), " at ", t.x(), " ", t.y(), " ", t.z());
}

}  // namespace

void ServiceProgram::PutBody() {
  v1::PutBodyRequest request;
  v1::PutBodyResponse response;
  FillMessage(in_, Hints(), &request);
  // Usually a few existing hulls, close together, without a condition.
  if (!in_.OneOf(4)) {
    request.clear_if_revision();
    while (request.pieces_size() > 4) request.mutable_pieces()->RemoveLast();
    for (v1::Placement& piece : *request.mutable_pieces()) {
      piece.set_hull_id(AnyHull());
      if (!in_.OneOf(4)) piece.clear_pose();
    }
  }
  if (!Call(Rpc::kPutBody, *service_.bodies_, &v1::BodyService::Stub::PutBody, request,
            &response)) {
    // The put may have taken effect anyway.
    bodies_.erase(request.body_id());
    return;
  }
  const v1::BodyInfo& body = response.body();
  if (body.piece_count() != static_cast<uint64_t>(request.pieces_size()) ||
      body.revision() != response.header().revision() ||
      response.created() != (body.revision() == body.create_revision())) {
    Note("a put returns a different body: " + body.ShortDebugString());
  }
  bodies_[request.body_id()] = request;
  QueryBody();
  if (in_.OneOf(4)) GetBody();
  if (in_.OneOf(4)) DeleteBody();
}

std::string ServiceProgram::AnyHull() {
  if (hulls_.empty()) return "cube";
  return std::next(hulls_.begin(), static_cast<ptrdiff_t>(in_.Below(hulls_.size())))->first;
}

void ServiceProgram::GetBody() {
  v1::GetBodyRequest request;
  v1::GetBodyResponse response;
  FillMessage(in_, Hints(), &request);
  if (!bodies_.empty() && !in_.OneOf(4)) request.set_body_id(bodies_.begin()->first);
  if (!Call(Rpc::kGetBody, *service_.bodies_, &v1::BodyService::Stub::GetBody, request,
            &response)) {
    return;
  }
  const auto known = bodies_.find(request.body_id());
  if (known == bodies_.end()) return;
  if (response.pieces_size() != known->second.pieces_size()) {
    return Note("a body has a different number of pieces than were put");
  }
  for (int i = 0; i < response.pieces_size(); ++i) {
    if (Text(response.pieces(i)) == Text(known->second.pieces(i))) continue;
    Note(absl::StrCat("piece ", i, " of a body is ", Text(response.pieces(i)), "; put was ",
                      Text(known->second.pieces(i))));
  }
  Reach("GetBody compared");
}

void ServiceProgram::ListBodies() {
  v1::ListBodiesRequest request;
  v1::ListBodiesResponse response;
  FillMessage(in_, Hints(), &request);
  if (!Call(Rpc::kListBodies, *service_.bodies_, &v1::BodyService::Stub::ListBodies, request,
            &response)) {
    return;
  }
  std::string before;
  for (const v1::BodyInfo& body : response.bodies()) {
    if (body.body_id() <= before || !body.body_id().starts_with(request.prefix())) {
      Note("bodies are listed out of order, or beyond the prefix");
    }
    before = body.body_id();
  }
  // All on one page.
  if (!request.page_token().empty() || !response.next_page_token().empty()) return;
  for (const auto& [id, body] : bodies_) {
    const bool is_listed = std::ranges::any_of(
        response.bodies(), [&id](const v1::BodyInfo& one) { return one.body_id() == id; });
    if (!is_listed && id.starts_with(request.prefix())) Note("body " + id + " is not listed");
  }
}

void ServiceProgram::DeleteBody() {
  v1::DeleteBodyRequest request;
  v1::DeleteBodyResponse response;
  FillMessage(in_, Hints(), &request);
  if (!bodies_.empty() && !in_.OneOf(4)) request.set_body_id(bodies_.begin()->first);
  if (!in_.OneOf(4)) request.clear_if_revision();
  Call(Rpc::kDeleteBody, *service_.bodies_, &v1::BodyService::Stub::DeleteBody, request, &response);
  bodies_.erase(request.body_id());
}

// Queries a body at the identity pose, so that its pieces can be queried at the same places:
// against any placement, or another such body.
void ServiceProgram::QueryBody() {
  if (bodies_.empty()) return;
  const auto any_body = [this] {
    return std::next(bodies_.begin(), static_cast<ptrdiff_t>(in_.Below(bodies_.size())))->first;
  };
  v1::CheckCollisionRequest request;
  FillMessage(in_, Hints(), request.mutable_b());
  request.mutable_a()->set_hull_id(any_body());
  // Its sum with the radius of a piece may not be a double.
  request.mutable_a()->clear_radius();
  if (in_.OneOf(3)) {
    request.mutable_b()->set_hull_id(any_body());
    request.mutable_b()->clear_pose();
    request.mutable_b()->clear_radius();
  } else if (!in_.OneOf(4)) {
    request.mutable_b()->set_hull_id(AnyHull());
    v1::Pose* const pose = request.mutable_b()->mutable_pose();
    pose->Clear();
    pose->mutable_translation()->set_x(0.5 * static_cast<double>(in_.Below(6)));
  }
  request.mutable_wanted()->set_certificate(true);
  v1::CheckCollisionResponse response;
  if (!Call(Rpc::kCheckCollision, *service_.collisions_,
            &v1::CollisionService::Stub::CheckCollision, request, &response)) {
    return;
  }
  Note(CheckPair(request, response));
  if (finding_.empty()) CompareWithPieces(request, response);
}

void ServiceProgram::CompareWithPieces(const v1::CheckCollisionRequest& request,
                                       const v1::CheckCollisionResponse& response) {
  using Pieces = google::protobuf::RepeatedPtrField<v1::Placement>;
  const auto pieces_of = [this](const v1::Placement& placement) {
    const auto body = bodies_.find(placement.hull_id());
    Pieces pieces;
    if (body == bodies_.end()) {
      *pieces.Add() = placement;
    } else {
      pieces = body->second.pieces();
    }
    return pieces;
  };
  const Pieces a = pieces_of(request.a());
  const Pieces b = pieces_of(request.b());
  // A body that is unknown, moves, or has another pose cannot be compared with its pieces.
  const bool is_elsewhere =
      request.b().has_end_pose() || (bodies_.contains(request.b().hull_id()) &&
                                     (request.b().has_pose() || request.b().radius() != 0));
  const bool is_known =
      bodies_.contains(request.b().hull_id()) || hulls_.contains(request.b().hull_id());
  if (is_elsewhere || !is_known || a.size() * b.size() > kMaxComparedPairs) return;
  v1::BatchCheckCollisionsRequest batch;
  *batch.mutable_placements() = a;
  batch.mutable_placements()->MergeFrom(b);
  for (int i = 0; i < a.size(); ++i) {
    for (int j = 0; j < b.size(); ++j) {
      batch.add_pairs(static_cast<uint32_t>(i));
      batch.add_pairs(static_cast<uint32_t>(a.size() + j));
    }
  }
  v1::Relation strongest = v1::RELATION_SEPARATED;
  for (const v1::Relation relation : QueryBatch(batch)) {
    if (Strength(relation) > Strength(strongest)) strongest = relation;
    if (relation == v1::RELATION_UNSPECIFIED)
      Note("a body has an answer, but one of its pieces has none");
  }
  if (strongest != response.relation()) {
    return Note(absl::StrCat("a body is ", v1::Relation_Name(response.relation()),
                             ", its pieces are ", v1::Relation_Name(strongest)));
  }
  std::map<std::string, std::vector<double>> vertices;
  for (const v1::Placement& piece : batch.placements()) {
    if (!vertices.contains(piece.hull_id())) {
      vertices[piece.hull_id()] = VerticesOf(piece.hull_id());
    }
  }
  const auto placed = [&vertices](const Pieces& pieces) {
    std::vector<PlacedVertices> all;
    for (const v1::Placement& piece : pieces) {
      all.push_back({vertices[piece.hull_id()], piece.pose(), nullptr, false, {piece.radius()}});
    }
    return all;
  };
  const absl::Status proven = CheckPieceCertificates(
      response.relation(), response.piece_certificates(), placed(a), placed(b));
  if (!proven.ok() && finding_.empty()) Note("certificates of pieces: " + proven.ToString());
  Reach(absl::StrCat("body compared ", v1::Relation_Name(response.relation())));
}

}  // namespace hulld::fuzz
