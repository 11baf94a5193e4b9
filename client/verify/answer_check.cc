#include "client/verify/answer_check.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "client/verify/certificate_check.h"

namespace hulld {
namespace {

constexpr int kAttempts = 5;

bool IsSame(const v1::HullInfo& hull, const v1::HullVersion& version) {
  return hull.create_revision() == version.create_revision() &&
         hull.revision() == version.revision();
}

}  // namespace

absl::StatusOr<const HullMesh*> AnswerChecker::Fetch(const v1::HullVersion& version,
                                                     Verification* problem) {
  const std::string& id = version.hull_id();
  auto known = meshes_.find(id);
  // A mesh that is newer than the answer stays so; fetching it again would not help.
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
  if (header.header().store_id() != version.store_id()) {
    *problem = {Verdict::kCannotCheck, "the server holds another store than the answer's"};
    return nullptr;
  }
  if (!IsSame(header.hull(), version)) {
    *problem = {Verdict::kMoved,
                absl::StrCat("hull ", id, " is at revision ", header.hull().revision(),
                             "; the answer is from revision ", version.revision())};
    return nullptr;
  }
  return &known->second;
}

absl::StatusOr<Verification> AnswerChecker::Check(const CheckedAnswer& answer) {
  if (answer.relation == v1::RELATION_UNSPECIFIED ||
      answer.relation == v1::RELATION_WITHIN_TOLERANCE) {
    return Verification{Verdict::kCannotCheck,
                        absl::StrCat(v1::Relation_Name(answer.relation), " has no certificate")};
  }
  if (answer.hull_a.hull_id() != answer.a.hull_id() ||
      answer.hull_b.hull_id() != answer.b.hull_id()) {
    return Verification{Verdict::kInvalid, "the answer is about other hulls than the request"};
  }
  Verification verification;
  const auto a = Fetch(answer.hull_a, &verification);
  if (!a.ok()) return a.status();
  if (*a == nullptr) return verification;
  const auto b = Fetch(answer.hull_b, &verification);
  if (!b.ok()) return b.status();
  if (*b == nullptr) return verification;
  const absl::Status checked =
      CheckCertificate(answer.relation, answer.certificate, {(*a)->xyz, answer.a.pose()},
                       {(*b)->xyz, answer.b.pose()});
  if (checked.ok()) return Verification{Verdict::kValid, ""};
  return Verification{Verdict::kInvalid, std::string(checked.message())};
}

absl::StatusOr<VerifiedResponse> CheckCollisionVerified(const Client& client,
                                                        const v1::CheckCollisionRequest& request) {
  AnswerChecker checker(client);
  VerifiedResponse verified;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    absl::StatusOr<v1::CheckCollisionResponse> response = client.CheckCollision(request);
    if (!response.ok()) return response.status();
    verified.response = *std::move(response);
    const v1::CheckCollisionResponse& answer = verified.response;
    absl::StatusOr<Verification> verification =
        checker.Check({request.a(), request.b(), answer.relation(), answer.certificate(),
                       answer.hull_a(), answer.hull_b()});
    if (!verification.ok()) return verification.status();
    verified.verification = *std::move(verification);
    if (verified.verification.verdict != Verdict::kMoved) break;
  }
  return verified;
}

}  // namespace hulld
