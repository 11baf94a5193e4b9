#ifndef HULLD_CORE_QUERY_CERTIFICATION_H_
#define HULLD_CORE_QUERY_CERTIFICATION_H_

#include <absl/status/statusor.h>

#include <functional>

#include "core/query/exact/exact_pair.h"
#include "core/query/ladder.h"
#include "core/query/terms/certificate.h"

namespace hulld {

// What makes the decision checkable. Where the decision came from floating point with all that is
// needed, it is copied; otherwise found in exact arithmetic. Requires a relation other than
// kWithinTolerance, and `exact` of the same pair (unchecked: a decision does not name its pair).
// CANCELLED when should_stop, which may be empty, said so.
absl::StatusOr<Certificate> MakeCertificate(ExactPair& exact, const Decision& decision,
                                            const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_CERTIFICATION_H_
