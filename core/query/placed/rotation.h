#ifndef HULLD_CORE_QUERY_PLACED_ROTATION_H_
#define HULLD_CORE_QUERY_PLACED_ROTATION_H_

#include "core/numeric/vector.h"
#include "core/query/placed/plain_vector.h"

namespace hulld {

// Matrix products in registers, with every product and sum rounded separately. Eigen's own products
// use fused operations where the processor has them, regardless of the compiler flags, so results
// would differ between processors.

// Returns R p.
inline Vector Product(const Eigen::Matrix3d& R, const PlainVector& p) {
  const double* const r = R.data();  // column by column
  return {r[0] * p.x + r[3] * p.y + r[6] * p.z, r[1] * p.x + r[4] * p.y + r[7] * p.z,
          r[2] * p.x + r[5] * p.y + r[8] * p.z};
}

// Returns the transpose of R, times p.
inline Vector TransposedProduct(const Eigen::Matrix3d& R, const PlainVector& p) {
  const double* const r = R.data();  // column by column
  return {r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
          r[6] * p.x + r[7] * p.y + r[8] * p.z};
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_ROTATION_H_
