#ifndef HULLD_CLIENT_VERIFY_PIECE_CHECK_H_
#define HULLD_CLIENT_VERIFY_PIECE_CHECK_H_

#include <absl/status/status.h>
#include <google/protobuf/repeated_field.h>

#include <span>

#include "client/verify/exact_hull.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

using PieceCertificates = google::protobuf::RepeatedPtrField<v1::PieceCertificate>;

// Returns OK if these certificates prove that A and B, each given by all of its pieces in order,
// are in this relation; otherwise FAILED_PRECONDITION, which names the pieces and the missing
// proof. Like CheckCertificate, the check is exact and follows from the definitions in the proto
// files alone.
//
// Each certificate must prove its own relation for its own pair. None of these relations may be
// stronger than that of the bodies, and one must equal it, unless the bodies are SEPARATED. Every
// pair without a certificate must be settled, unless the bodies are OVERLAPPING: one of its hulls
// is empty, or the exact bounding boxes of both along the world axes are disjoint.
//
// Cost: about a microsecond per vertex of each piece and of each certificate; about a nanosecond
// per pair of pieces.
absl::Status CheckPieceCertificates(v1::Relation relation, const PieceCertificates& certificates,
                                    std::span<const PlacedVertices> a,
                                    std::span<const PlacedVertices> b);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_PIECE_CHECK_H_
