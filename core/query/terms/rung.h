#ifndef HULLD_CORE_QUERY_TERMS_RUNG_H_
#define HULLD_CORE_QUERY_TERMS_RUNG_H_

namespace hulld {

// What decided an answer.
enum class Rung {
  kBounds,         // spheres round the hulls; for the relation alone, their reach between centres
  kCached,         // the axis or the vertex pairs of the previous query of the pair
  kFloatingPoint,  // the hulls, in floating point with a proven error bound
  kExact,          // exact arithmetic
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_RUNG_H_
