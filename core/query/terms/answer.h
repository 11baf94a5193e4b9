#ifndef HULLD_CORE_QUERY_TERMS_ANSWER_H_
#define HULLD_CORE_QUERY_TERMS_ANSWER_H_

#include <optional>

#include "core/query/terms/analysis.h"
#include "core/query/terms/axis.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/rung.h"
#include "core/query/terms/separation.h"

namespace hulld {

struct Answer {
  Relation relation = Relation::kSeparated;
  Rung rung = Rung::kExact;
  // When wanted, the relation is SEPARATED or TOUCHING, and neither hull is empty.
  std::optional<SeparatingAxis> axis;
  Analysis analysis;
  // When wanted and neither hull is empty.
  std::optional<Certificate> certificate;
  // When wanted; infinite when a hull is empty.
  std::optional<Separation> separation;
  // When wanted and neither hull is empty.
  std::optional<Witness> witness;
  // When wanted: whether separation <= QueryOptions::clearance. False when a hull is empty.
  std::optional<bool> within_clearance;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_ANSWER_H_
