#ifndef HULLD_CLIENT_VERIFY_MOTION_CHECK_H_
#define HULLD_CLIENT_VERIFY_MOTION_CHECK_H_

#include <absl/status/status.h>

#include <span>

#include "client/verify/exact_hull.h"
#include "client/verify/piece_check.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// A hull or a piece of a body in motion. `end` equals start.pose if it is at rest.
struct MovingVertices {
  PlacedVertices start;
  const v1::Pose& end;
};

// Wanted.max_time_error, or its default.
double MaxTimeError(const v1::Wanted& wanted);

// Returns OK if the intervals prove that A and B are separated up to contact.separated_until, and
// the certificate proves their contact at contact.contact_time; for SEPARATED, if the intervals
// cover the motion. Otherwise FAILED_PRECONDITION with the missing proof. OUT_OF_RANGE: everything
// is proven, but the two times are more than max_time_error apart, which the contract allows if the
// pair is nearly in contact in between. Like CheckCertificate, the check is exact and follows from
// the definitions in the proto files alone.
//
// For a translation without radii, the certificate proves contact at contact_time, or between
// separated_until and contact_time; that a TOUCHING pair never overlaps, or that an OVERLAPPING
// pair which touches at contact_time overlaps later, is not part of the proof.
//
// Cost: O(vertices) operations on integers of any length per interval: a few microseconds per
// vertex.
absl::Status CheckFirstContact(v1::Relation relation, const v1::FirstContact& contact,
                               const v1::Certificate& at_contact, const MovingVertices& a,
                               const MovingVertices& b, double max_time_error);

// Does the same for the first contact of two bodies. a, b: all pieces of each body, in order. Every
// pair of nonempty pieces must have intervals up to contact.separated_until. If the bodies meet,
// one pair must be in contact and have the relation of the bodies; for translations without radii,
// it may be TOUCHING if the bodies are OVERLAPPING, because they may overlap later.
absl::Status CheckFirstContact(v1::Relation relation, const v1::FirstContact& contact,
                               const PieceCertificates& certificates,
                               std::span<const MovingVertices> a, std::span<const MovingVertices> b,
                               double max_time_error);

}  // namespace hulld

#endif  // HULLD_CLIENT_VERIFY_MOTION_CHECK_H_
