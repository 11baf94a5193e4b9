#ifndef HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_
#define HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_

#include <absl/status/status.h>

#include "client/verify/exact_hull.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Whether the certificate proves that A and B are in this relation, in exact arithmetic over the
// doubles given, from the definitions in collision.proto and geometry.proto alone: this code shares
// nothing with the server's. OK, or FAILED_PRECONDITION with what the certificate fails to show.
// Parts that the relation does not need are ignored. Vertices that come with coordinates must be
// those of their index.
//
// An empty hull is separated from everything, and needs no certificate for that.
//
// Cost: O(vertices) operations on integers of any length: about a microsecond per vertex.
absl::Status CheckCertificate(v1::Relation relation, const v1::Certificate& certificate,
                              const PlacedVertices& a, const PlacedVertices& b);

// The same for hulls that are not empty, both at one exponent.
absl::Status CheckExactly(v1::Relation relation, const v1::Certificate& certificate,
                          const ExactHull& a, const ExactHull& b);

// OK, or FAILED_PRECONDITION: a relation that no certificate proves.
absl::Status CheckRelation(v1::Relation relation);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_
