#ifndef HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_
#define HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_

#include <absl/status/status.h>

#include <span>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/geometry.pb.h"

namespace hulld {

// A hull as the check takes it: its vertices, x y z each, and its pose.
struct PlacedVertices {
  std::span<const double> xyz;
  const v1::Pose& pose;
};

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

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_
