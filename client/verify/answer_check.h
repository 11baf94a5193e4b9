#ifndef HULLD_CLIENT_VERIFY_ANSWER_CHECK_H_
#define HULLD_CLIENT_VERIFY_ANSWER_CHECK_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/verify/exact_hull.h"
#include "client/verify/piece_check.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

enum class Verdict {
  // The certificate proves the relation.
  kValid,
  // It does not.
  kInvalid,
  // There is nothing to check, or the hulls that the answer was computed from are gone.
  kCannotCheck,
  // The same because a hull has changed since; asking again may do better.
  kMoved,
};

struct Verification {
  Verdict verdict = Verdict::kCannotCheck;
  // Why, unless valid.
  std::string reason;
};

// One answer and what it answers.
struct CheckedAnswer {
  const v1::Placement& a;
  const v1::Placement& b;
  v1::Relation relation;
  const v1::Certificate& certificate;
  const v1::HullVersion& hull_a;
  const v1::HullVersion& hull_b;
};

// Revisions of hulls, by ID.
using HullVersions = std::map<std::string, const v1::HullVersion*>;

// One answer about a pair of which at least one is a body.
struct CheckedBodies {
  const v1::Placement& a;
  const v1::Placement& b;
  v1::Relation relation;
  const v1::HullVersion& hull_a;
  const v1::HullVersion& hull_b;
  const PieceCertificates& certificates;
  // The hulls of all pieces; a hull beside bodies may be among them or not.
  const HullVersions& piece_hulls;
  // The pieces that the answer says decided; none for a hull, and none where it names none.
  std::optional<uint32_t> piece_a;
  std::optional<uint32_t> piece_b;
};

// Checks answers against the hulls that GetHullMesh returns, and the bodies that GetBody does.
class AnswerChecker {
 public:
  // `client` must outlive this.
  explicit AnswerChecker(const Client& client) : client_(client) {}

  // Fetches the hulls that it does not have yet and returns the errors of that. A hull that was
  // deleted is kMoved.
  absl::StatusOr<Verification> Check(const CheckedAnswer& answer);
  absl::StatusOr<Verification> Check(const CheckedBodies& answer);
  // The same of a single call, which may be about bodies.
  absl::StatusOr<Verification> Check(const v1::CheckCollisionRequest& request,
                                     const v1::CheckCollisionResponse& response);

 private:
  // Null, with the reason, when the server no longer has the mesh at that version.
  absl::StatusOr<const HullMesh*> Fetch(const v1::HullVersion& version, Verification* problem);
  // The same of a body; null without a reason where there is none of this ID.
  absl::StatusOr<const v1::GetBodyResponse*> FetchBody(const v1::HullVersion& version,
                                                       Verification* problem);
  // The pieces of what is placed, or of a hull itself; none, with the reason, when the server no
  // longer has all. `named`: whether the answer names a piece of it. They refer to what this keeps.
  absl::StatusOr<std::vector<PlacedVertices>> FetchPieces(const v1::Placement& placement,
                                                          const v1::HullVersion& version,
                                                          bool named, const HullVersions& hulls,
                                                          Verification* problem);

  const Client& client_;
  std::map<std::string, HullMesh> meshes_;
  std::map<std::string, v1::GetBodyResponse> bodies_;
};

// Asks and checks the answer; a few times, as long as a hull changes in between. Returns the last
// answer and its verification.
struct VerifiedResponse {
  v1::CheckCollisionResponse response;
  Verification verification;
};
absl::StatusOr<VerifiedResponse> CheckCollisionVerified(const Client& client,
                                                        const v1::CheckCollisionRequest& request);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_ANSWER_CHECK_H_
