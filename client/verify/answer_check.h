#ifndef HULLD_CLIENT_VERIFY_ANSWER_CHECK_H_
#define HULLD_CLIENT_VERIFY_ANSWER_CHECK_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <list>
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
  // The certificate does not prove the relation.
  kInvalid,
  // The answer has nothing to check, or its hulls no longer exist.
  kCannotCheck,
  // The answer cannot be checked because a hull has changed since; a new query may succeed.
  kMoved,
};

struct Verification {
  Verdict verdict = Verdict::kCannotCheck;
  // The reason, unless valid.
  std::string reason;
};

// One answer and its query.
struct CheckedAnswer {
  const v1::Placement& a;
  const v1::Placement& b;
  v1::Relation relation;
  const v1::Certificate& certificate;
  const v1::HullVersion& hull_a;
  const v1::HullVersion& hull_b;
  // For a pair in motion; null if the answer has none.
  const v1::FirstContact* first_contact = nullptr;
  // Maximum width of its bracket, as requested.
  double max_time_error = 0;
};

// Revisions of hulls, by ID.
using HullVersions = std::map<std::string, const v1::HullVersion*>;

// One answer about a pair with at least one body.
struct CheckedBodies {
  const v1::Placement& a;
  const v1::Placement& b;
  v1::Relation relation;
  const v1::HullVersion& hull_a;
  const v1::HullVersion& hull_b;
  const PieceCertificates& certificates;
  // The hulls of all pieces. May include the other side if that is a hull.
  const HullVersions& piece_hulls;
  // The deciding pieces; absent for a hull, and if the answer names none.
  std::optional<uint32_t> piece_a;
  std::optional<uint32_t> piece_b;
  // The contact and accuracy of pairs in motion; see CheckedAnswer.
  const v1::FirstContact* first_contact = nullptr;
  double max_time_error = 0;
};

// Checks answers against the points of inline shapes, and the hulls and bodies that GetHullMesh and
// GetBody return.
class AnswerChecker {
 public:
  // `client` must outlive this object.
  explicit AnswerChecker(const Client& client) : client_(client) {}

  // Fetches missing hulls, and returns the errors of these calls. If a hull was deleted, the
  // verdict is kMoved.
  absl::StatusOr<Verification> Check(const CheckedAnswer& answer);
  absl::StatusOr<Verification> Check(const CheckedBodies& answer);
  // Same as above, for a single call, which may concern bodies.
  absl::StatusOr<Verification> Check(const v1::CheckCollisionRequest& request,
                                     const v1::CheckCollisionResponse& response);

 private:
  // Returns null, and sets the reason, if the server no longer has the mesh at that version.
  absl::StatusOr<const HullMesh*> Fetch(const v1::HullVersion& version, Verification* problem);
  // Returns the vertices of a placed hull, or the points of its inline shape; nullopt as above. The
  // result refers to data of the placement and of this object.
  absl::StatusOr<std::optional<PlacedVertices>> FetchHull(const v1::Placement& placement,
                                                          const v1::HullVersion& version,
                                                          Verification* problem);
  // Same as Fetch, for a body; null without a reason if no body has this ID.
  absl::StatusOr<const v1::GetBodyResponse*> FetchBody(const v1::HullVersion& version,
                                                       Verification* problem);
  // Returns the pieces of a placed body, or the hull itself; none, with the reason, if the server
  // no longer has all of them. `named`: true if the answer names a piece. The result refers to data
  // kept by this object.
  absl::StatusOr<std::vector<PlacedVertices>> FetchPieces(const v1::Placement& placement,
                                                          const v1::HullVersion& version,
                                                          bool named, const HullVersions& hulls,
                                                          Verification* problem);

  const Client& client_;
  std::map<std::string, HullMesh> meshes_;
  std::map<std::string, v1::GetBodyResponse> bodies_;
  // Points of inline shapes in single precision.
  std::list<std::vector<double>> widened_;
};

// Queries and checks the answer; retries a few times while a hull changes in between. Returns the
// last answer and its verification.
struct VerifiedResponse {
  v1::CheckCollisionResponse response;
  Verification verification;
};
absl::StatusOr<VerifiedResponse> CheckCollisionVerified(const Client& client,
                                                        const v1::CheckCollisionRequest& request);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_ANSWER_CHECK_H_
