#ifndef HULLD_CLIENT_VERIFY_SIMPLIFICATION_CHECK_H_
#define HULLD_CLIENT_VERIFY_SIMPLIFICATION_CHECK_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>

#include "client/client.h"
#include "client/verify/answer_check.h"
#include "hulld/v1/hull.pb.h"

namespace hulld {

// Returns OK if a simplification satisfies the request and the claims of its header, and
// FAILED_PRECONDITION with the first claim that does not hold. The check is exact for the given
// doubles. It follows from the definitions in hull.proto alone, and shares no code with the server.
//
// Inside: each vertex is a vertex of the hull, and each vertex of the hull is within the error of
// the simplification. Outside: the simplification contains each vertex of the hull, and each of its
// vertices is within the error of the hull. This bounds the Hausdorff distance, because the
// distance from a convex set is largest at a vertex. The number of vertices is at most
// max_vertices, and with max_error alone, the error is at most max_error. With both limits, the
// check does not look for another hull that meets both.
//
// A point is within the error if it is within the error of a triangle of vertices, and inside if a
// tetrahedron of vertices contains it. Facets only guide the search: wrong facets can make the
// check reject a true claim, but never accept a false one. Cost: about n log n, and about ten
// microseconds of exact arithmetic per vertex.
absl::Status CheckSimplification(const v1::Simplification& requested, const HullMesh& hull,
                                 const HullMesh& simplified);

// Fetches a simplification and its hull at the same revision and checks it; retries a few times
// while the hull changes in between. Returns the last simplification and its verification. on_part:
// as for Client::GetHullMesh, of the simplification. INVALID_ARGUMENT: the request has no
// simplification.
struct VerifiedMesh {
  HullMesh mesh;
  Verification verification;
};
absl::StatusOr<VerifiedMesh> GetSimplificationVerified(
    const Client& client, const v1::GetHullMeshRequest& request,
    const std::function<void(const HullMesh&)>& on_part = {});

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_SIMPLIFICATION_CHECK_H_
