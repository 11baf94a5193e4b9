#ifndef HULLD_CORE_QUERY_CERTIFICATION_H_
#define HULLD_CORE_QUERY_CERTIFICATION_H_

#include <absl/status/statusor.h>

#include <functional>

#include "core/query/exact/exact_pair.h"
#include "core/query/ladder.h"
#include "core/query/terms/certificate.h"

namespace hulld {

// Returns the certificate of a decision. Copies it if the decision came from floating point with
// all evidence, and otherwise finds it in exact arithmetic. Requires: a relation other than
// kWithinTolerance, and `exact` of the same pair (unchecked: a decision does not name its pair).
// CANCELLED: should_stop, which may be empty, returned true.
absl::StatusOr<Certificate> MakeCertificate(ExactPair& exact, const Decision& decision,
                                            const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_CERTIFICATION_H_
