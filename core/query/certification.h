#ifndef HULLD_CORE_QUERY_CERTIFICATION_H_
#define HULLD_CORE_QUERY_CERTIFICATION_H_

#include <absl/status/statusor.h>

#include <functional>
#include <span>

#include "core/numeric/vector.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/ladder.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Returns the certificate of a decision. Copies it if the decision came from floating point with
// all evidence, and otherwise finds it in exact arithmetic. Requires: a relation other than
// kWithinTolerance, and `exact` of the same pair (unchecked: a decision does not name its pair).
// CANCELLED: should_stop, which may be empty, returned true.
absl::StatusOr<Certificate> MakeCertificate(ExactPair& exact, const Decision& decision,
                                            const std::function<bool()>& should_stop);

// Returns the certificate of a relation of rounded hulls, at least one of which has a radius: the
// direction in which the cores are nearest, and the pairs of vertices that surround the nearest
// point of A - B. `hint`: a direction that may prove SEPARATED; zero if unknown. `seed`: pairs of
// vertices near that point; at most four, may be empty. Otherwise as MakeCertificate.
absl::StatusOr<Certificate> MakeRoundedCertificate(ExactPair& exact, Relation relation,
                                                   const Vector& hint,
                                                   std::span<const VertexPair> seed,
                                                   const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_CERTIFICATION_H_
