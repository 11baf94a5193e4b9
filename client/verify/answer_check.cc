#include "client/verify/answer_check.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "client/base/status_macros.h"
#include "client/verify/certificate_check.h"
#include "client/verify/motion_check.h"

namespace hulld {
namespace {

constexpr int kMeshReadAttempts = 5;

// Returns the reason why a hull or a body, called `what`, is not the one of an answer; OK if it is.
template <typename Info>
Verification Matched(const char* what, const v1::ResponseHeader& header, const Info& info,
                     const v1::HullVersion& version) {
  if (header.store_id() != version.store_id()) {
    return {Verdict::kCannotCheck, "the server's store is not the one that the answer came from"};
  }
  if (info.create_revision() == version.create_revision() &&
      info.revision() == version.revision()) {
    return {};
  }
  return {Verdict::kMoved,
          absl::StrCat(what, " ", version.hull_id(), " is at revision ", info.revision(),
                       "; the answer is from revision ", version.revision())};
}

// Returns the reason that precludes a check; none for an answer that matches the query.
std::optional<Verification> Precluded(v1::Relation relation, const v1::Placement& a,
                                      const v1::HullVersion& of_a, const v1::Placement& b,
                                      const v1::HullVersion& of_b) {
  if (relation == v1::RELATION_UNSPECIFIED || relation == v1::RELATION_WITHIN_TOLERANCE) {
    return Verification{Verdict::kCannotCheck,
                        absl::StrCat(v1::Relation_Name(relation), " has no certificate")};
  }
  if (of_a.hull_id() == a.hull_id() && of_b.hull_id() == b.hull_id()) return std::nullopt;
  return Verification{Verdict::kInvalid, "the answer is for hulls other than the request's"};
}

Verification FromStatus(const absl::Status& checked) {
  if (checked.ok()) return Verification{Verdict::kValid, ""};
  if (absl::IsOutOfRange(checked)) {
    return Verification{Verdict::kCannotCheck, std::string(checked.message())};
  }
  return Verification{Verdict::kInvalid, std::string(checked.message())};
}

bool IsMoving(const v1::Placement& a, const v1::Placement& b) {
  return a.has_end_pose() || b.has_end_pose();
}

MovingVertices Moving(const PlacedVertices& hull, const v1::Placement& placement) {
  return {hull, placement.has_end_pose() ? placement.end_pose() : placement.pose()};
}

absl::Status CheckProof(const CheckedAnswer& answer, const PlacedVertices& a,
                        const PlacedVertices& b) {
  if (!IsMoving(answer.a, answer.b)) {
    return CheckCertificate(answer.relation, answer.certificate, a, b);
  }
  if (answer.first_contact == nullptr) {
    return ProofFails("the answer is about a motion, but has no first contact");
  }
  return CheckFirstContact(answer.relation, *answer.first_contact, answer.certificate,
                           Moving(a, answer.a), Moving(b, answer.b), answer.max_time_error);
}

// Returns true if the deciding pieces named in the answer are proven to be in its relation.
bool IsDecidingPairProven(const CheckedBodies& answer) {
  if (answer.relation == v1::RELATION_SEPARATED) return true;
  const auto decides = [&](const v1::PieceCertificate& of) {
    // A translation may overlap later.
    const bool shows = IsMoving(answer.a, answer.b) ? of.relation() != v1::RELATION_SEPARATED
                                                    : of.relation() == answer.relation;
    return shows && of.piece_a() == answer.piece_a.value_or(0) &&
           of.piece_b() == answer.piece_b.value_or(0);
  };
  return std::any_of(answer.certificates.begin(), answer.certificates.end(), decides);
}

std::vector<MovingVertices> Moving(const std::vector<PlacedVertices>& pieces,
                                   const v1::Placement& placement) {
  std::vector<MovingVertices> moving;
  moving.reserve(pieces.size());
  for (const PlacedVertices& piece : pieces) moving.push_back(Moving(piece, placement));
  return moving;
}

absl::Status CheckProof(const CheckedBodies& answer, const std::vector<PlacedVertices>& a,
                        const std::vector<PlacedVertices>& b) {
  if (!IsMoving(answer.a, answer.b)) {
    return CheckPieceCertificates(answer.relation, answer.certificates, a, b);
  }
  if (answer.first_contact == nullptr) {
    return ProofFails("the answer is about a motion, but has no first contact");
  }
  return CheckFirstContact(answer.relation, *answer.first_contact, answer.certificates,
                           Moving(a, answer.a), Moving(b, answer.b), answer.max_time_error);
}

std::optional<uint32_t> IndexOf(bool has_piece, const v1::DecidingPiece& piece) {
  return has_piece ? std::optional(piece.index()) : std::nullopt;
}

}  // namespace

absl::StatusOr<const HullMesh*> AnswerChecker::Fetch(const v1::HullVersion& version,
                                                     Verification* problem) {
  const std::string& id = version.hull_id();
  auto known = meshes_.find(id);
  // A mesh newer than the answer cannot match it; fetching it again would not help.
  if (known == meshes_.end() || known->second.header.hull().revision() < version.revision()) {
    absl::StatusOr<HullMesh> mesh = client_.GetHullMesh(id);
    if (absl::IsNotFound(mesh.status())) {
      *problem = {Verdict::kMoved, absl::StrCat("hull ", id, " was deleted")};
      return nullptr;
    }
    if (!mesh.ok()) return mesh.status();
    known = meshes_.insert_or_assign(id, *std::move(mesh)).first;
  }
  const v1::MeshHeader& header = known->second.header;
  *problem = Matched("hull", header.header(), header.hull(), version);
  return problem->reason.empty() ? &known->second : nullptr;
}

absl::StatusOr<std::optional<PlacedVertices>> AnswerChecker::FetchHull(
    const v1::Placement& placement, const v1::HullVersion& version, Verification* problem) {
  if (placement.has_points()) {
    const v1::PointBlock& points = placement.points();
    std::span<const double> xyz(points.xyz().data(), static_cast<size_t>(points.xyz_size()));
    if (!points.xyz_float().empty()) {
      xyz = widened_.emplace_back(points.xyz_float().begin(), points.xyz_float().end());
    }
    return PlacedVertices{xyz, placement.pose(), nullptr, true, {placement.radius()}};
  }
  HULLD_ASSIGN_OR_RETURN(const auto mesh, Fetch(version, problem));
  if (mesh == nullptr) return std::nullopt;
  return PlacedVertices{mesh->xyz, placement.pose(), nullptr, false, {placement.radius()}};
}

absl::StatusOr<const v1::GetBodyResponse*> AnswerChecker::FetchBody(const v1::HullVersion& version,
                                                                    Verification* problem) {
  const std::string& id = version.hull_id();
  auto known = bodies_.find(id);
  if (known == bodies_.end() || known->second.body().revision() < version.revision()) {
    absl::StatusOr<v1::GetBodyResponse> body = client_.GetBody(id);
    if (absl::IsNotFound(body.status())) return nullptr;
    if (!body.ok()) return body.status();
    known = bodies_.insert_or_assign(id, *std::move(body)).first;
  }
  const v1::GetBodyResponse& body = known->second;
  *problem = Matched("body", body.header(), body.body(), version);
  return problem->reason.empty() ? &body : nullptr;
}

absl::StatusOr<std::vector<PlacedVertices>> AnswerChecker::FetchPieces(
    const v1::Placement& placement, const v1::HullVersion& version, bool named,
    const HullVersions& hulls, Verification* problem) {
  std::vector<PlacedVertices> pieces;
  const v1::GetBodyResponse* body = nullptr;
  if (!placement.has_points()) {
    HULLD_ASSIGN_OR_RETURN(const auto fetched, FetchBody(version, problem));
    if (!problem->reason.empty()) return pieces;
    body = fetched;
  }
  if (body == nullptr) {
    if (named) {
      *problem = {Verdict::kMoved, absl::StrCat("body ", version.hull_id(), " was deleted")};
      return pieces;
    }
    HULLD_ASSIGN_OR_RETURN(const auto hull, FetchHull(placement, version, problem));
    if (hull.has_value()) pieces.push_back(*hull);
    return pieces;
  }
  for (const v1::Placement& piece : body->pieces()) {
    const auto hull = hulls.find(piece.hull_id());
    if (hull == hulls.end()) {
      *problem = {Verdict::kInvalid,
                  absl::StrCat("piece ", pieces.size(), " of body ", version.hull_id(), " is hull ",
                               piece.hull_id(), ", whose revision the answer does not state")};
      return pieces;
    }
    HULLD_ASSIGN_OR_RETURN(const auto mesh, Fetch(*hull->second, problem));
    if (mesh == nullptr) return pieces;
    pieces.push_back(
        {mesh->xyz, placement.pose(), &piece.pose(), false, {placement.radius(), piece.radius()}});
  }
  return pieces;
}

absl::StatusOr<Verification> AnswerChecker::Check(const CheckedAnswer& answer) {
  if (const auto precluded =
          Precluded(answer.relation, answer.a, answer.hull_a, answer.b, answer.hull_b)) {
    return *precluded;
  }
  Verification verification;
  HULLD_ASSIGN_OR_RETURN(const auto a, FetchHull(answer.a, answer.hull_a, &verification));
  if (!a.has_value()) return verification;
  HULLD_ASSIGN_OR_RETURN(const auto b, FetchHull(answer.b, answer.hull_b, &verification));
  if (!b.has_value()) return verification;
  return FromStatus(CheckProof(answer, *a, *b));
}

absl::StatusOr<Verification> AnswerChecker::Check(const v1::CheckCollisionRequest& request,
                                                  const v1::CheckCollisionResponse& response) {
  if (!response.piece_hulls().empty()) {
    HullVersions hulls;
    for (const v1::HullVersion& hull : response.piece_hulls()) hulls.emplace(hull.hull_id(), &hull);
    return Check(CheckedBodies{request.a(), request.b(), response.relation(), response.hull_a(),
                               response.hull_b(), response.piece_certificates(), hulls,
                               IndexOf(response.has_piece_a(), response.piece_a()),
                               IndexOf(response.has_piece_b(), response.piece_b()),
                               response.has_first_contact() ? &response.first_contact() : nullptr,
                               MaxTimeError(request.wanted())});
  }
  if (response.has_piece_a() || response.has_piece_b()) {
    return Verification{Verdict::kCannotCheck, "the answer about bodies has no certificates"};
  }
  return Check(CheckedAnswer{request.a(), request.b(), response.relation(), response.certificate(),
                             response.hull_a(), response.hull_b(),
                             response.has_first_contact() ? &response.first_contact() : nullptr,
                             MaxTimeError(request.wanted())});
}

absl::StatusOr<Verification> AnswerChecker::Check(const CheckedBodies& answer) {
  if (const auto precluded =
          Precluded(answer.relation, answer.a, answer.hull_a, answer.b, answer.hull_b)) {
    return *precluded;
  }
  Verification verification;
  HULLD_ASSIGN_OR_RETURN(const auto a,
                         FetchPieces(answer.a, answer.hull_a, answer.piece_a.has_value(),
                                     answer.piece_hulls, &verification));
  if (!verification.reason.empty()) return verification;
  HULLD_ASSIGN_OR_RETURN(const auto b,
                         FetchPieces(answer.b, answer.hull_b, answer.piece_b.has_value(),
                                     answer.piece_hulls, &verification));
  if (!verification.reason.empty()) return verification;
  const absl::Status checked = CheckProof(answer, a, b);
  if (!checked.ok() || IsDecidingPairProven(answer)) return FromStatus(checked);
  return Verification{
      Verdict::kInvalid,
      absl::StrCat("the answer says that pieces ", answer.piece_a.value_or(0), " of A and ",
                   answer.piece_b.value_or(0), " of B decided, but no certificate shows that")};
}

absl::StatusOr<VerifiedResponse> CheckCollisionVerified(const Client& client,
                                                        const v1::CheckCollisionRequest& request) {
  AnswerChecker checker(client);
  VerifiedResponse verified;
  for (int attempt = 0; attempt < kMeshReadAttempts; ++attempt) {
    HULLD_ASSIGN_OR_RETURN(verified.response, client.CheckCollision(request));
    HULLD_ASSIGN_OR_RETURN(verified.verification, checker.Check(request, verified.response));
    if (verified.verification.verdict != Verdict::kMoved) break;
  }
  return verified;
}

}  // namespace hulld
