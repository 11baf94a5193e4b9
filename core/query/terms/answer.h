#ifndef HULLD_CORE_QUERY_TERMS_ANSWER_H_
#define HULLD_CORE_QUERY_TERMS_ANSWER_H_

#include <optional>

#include "core/base/boxed.h"
#include "core/query/terms/analysis.h"
#include "core/query/terms/axis.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/rung.h"
#include "core/query/terms/separation.h"

namespace hulld {

// The relation of a pair and what else was wanted. An answer of the relation alone is small and
// allocates nothing.
struct Answer {
  Relation relation = Relation::kSeparated;
  Rung rung = Rung::kBounds;
  // When wanted: whether separation <= QueryOptions::clearance. False when a hull is empty.
  std::optional<bool> within_clearance;
  // When wanted; infinite when a hull is empty.
  std::optional<Separation> separation;
  // When wanted and neither hull is empty.
  Boxed<Witness> witness;
  // When wanted, the relation is SEPARATED or TOUCHING, and neither hull is empty.
  Boxed<SeparatingAxis> axis;
  // When wanted.
  Boxed<Analysis> analysis;
  // When wanted and neither hull is empty.
  Boxed<Certificate> certificate;
};
// A batch holds one for each of its pairs.
static_assert(sizeof(Answer) <= 64);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_ANSWER_H_
