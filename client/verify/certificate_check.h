#ifndef HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_
#define HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/verify/exact_hull.h"
#include "client/verify/exact_vector.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Returns OK if the certificate proves that A and B are in this relation, and otherwise
// FAILED_PRECONDITION with the missing proof. The check is exact for the given doubles. It follows
// from the definitions in collision.proto and geometry.proto alone, and shares no code with the
// server. Parts of the certificate that the relation does not need are ignored. If vertices come
// with coordinates, these must match their indices.
//
// An empty hull is separated from everything, and needs no certificate for that.
//
// Cost: O(vertices) operations on integers of any length: about a microsecond per vertex.
absl::Status CheckCertificate(v1::Relation relation, const v1::Certificate& certificate,
                              const PlacedVertices& a, const PlacedVertices& b);

// Same as above, for hulls that are not empty, both at one exponent.
absl::Status CheckExactly(v1::Relation relation, const v1::Certificate& certificate,
                          const ExactHull& a, const ExactHull& b);

// Reads the direction of a certificate as integers times 2^exponent. FAILED_PRECONDITION: it is
// missing, malformed, or zero.
absl::Status ReadDirection(const v1::Certificate& certificate, BigVector* n,
                           int* exponent = nullptr);

// The limit of the contract, by Caratheodory's theorem for a point of a hull.
inline constexpr int kMaxTouchingPairs = 4;

// Returns the points of A - B that the vertex pairs represent, times both scales.
// FAILED_PRECONDITION: more than `max_pairs` pairs, or an index that is out of range.
absl::StatusOr<std::vector<BigVector>> DifferencesOf(const v1::Certificate& certificate,
                                                     int max_pairs, const ExactHull& a,
                                                     const ExactHull& b);

// Returns the sign of min n.B - max n.A - r |n|, r the sum of the radii.
int GapSign(const ExactHull& a, const ExactHull& b, const BigVector& n);

// Returns FAILED_PRECONDITION with the reason for the failed proof.
absl::Status ProofFails(const std::string& reason);

// OK, or FAILED_PRECONDITION: a relation that no certificate proves.
absl::Status CheckRelation(v1::Relation relation);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_CERTIFICATE_CHECK_H_
