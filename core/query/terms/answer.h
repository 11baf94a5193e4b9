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

// The relation of a pair and the requested details. An answer with the relation alone is small and
// allocates nothing.
struct Answer {
  Relation relation = Relation::kSeparated;
  Rung rung = Rung::kBounds;
  // If requested: true if separation <= QueryOptions::clearance. False if a hull is empty.
  std::optional<bool> within_clearance;
  // If requested; infinite if a hull is empty.
  OptionalSeparation separation;
  // If requested and neither hull is empty.
  Boxed<Witness> witness;
  // If requested and neither hull is empty.
  Boxed<Normal> normal;
  // If requested, the relation is SEPARATED or TOUCHING, and neither hull is empty.
  Boxed<SeparatingAxis> axis;
  // If requested.
  Boxed<Analysis> analysis;
  // If requested and neither hull is empty.
  Boxed<Certificate> certificate;
};
// A batch keeps an answer for each of its pairs.
static_assert(sizeof(Answer) <= 64);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_ANSWER_H_
