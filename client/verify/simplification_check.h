#ifndef HULLD_CLIENT_VERIFY_SIMPLIFICATION_CHECK_H_
#define HULLD_CLIENT_VERIFY_SIMPLIFICATION_CHECK_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>

#include "client/client.h"
#include "client/verify/answer_check.h"
#include "hulld/v1/hull.pb.h"

namespace hulld {

// Whether a simplification is what was asked for and what its header claims, in exact arithmetic
// over the doubles given, from the definitions in hull.proto alone: this code shares nothing with
// the server's. OK, or FAILED_PRECONDITION with the first claim that does not hold.
//
// Inside, each vertex is one of the hull's, and each vertex of the hull is within the error of the
// simplification; outside, each vertex of the hull is in the simplification, each vertex of which
// is within the error of the hull. That bounds the Hausdorff distance, as the distance from a
// convex set is largest at vertices. No more vertices than max_vertices; with max_error alone, no
// larger error. With both, whether some other hull keeps both is not looked at.
//
// A point counts as within the error when it is within the error of a triangle of vertices, and as
// inside when a tetrahedron of vertices holds it. Facets only tell where to look, so wrong facets
// make the check refuse what is true, and never accept what is not. Cost: about n log n, and some
// ten microseconds of exact arithmetic for each vertex.
absl::Status CheckSimplification(const v1::Simplification& asked, const HullMesh& hull,
                                 const HullMesh& simplified);

// Fetches a simplification and the hull that it stands for, both as of the same revision, and
// checks it; a few times, as long as the hull changes in between. Returns the last simplification
// and its verification. on_part: as for Client::GetHullMesh, of the simplification. Requires a
// request with a simplification; without one INVALID_ARGUMENT.
struct VerifiedMesh {
  HullMesh mesh;
  Verification verification;
};
absl::StatusOr<VerifiedMesh> GetSimplificationVerified(
    const Client& client, const v1::GetHullMeshRequest& request,
    const std::function<void(const HullMesh&)>& on_part = {});

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_SIMPLIFICATION_CHECK_H_
