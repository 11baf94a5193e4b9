#ifndef HULLD_CORE_QUERY_TERMS_SEPARATION_H_
#define HULLD_CORE_QUERY_TERMS_SEPARATION_H_

#include "core/numeric/vector.h"

namespace hulld {

// The signed separation: the distance when positive; minus the penetration depth, the distance from
// 0 to the boundary of A - B, when negative; 0 exactly when touching. |value - true value| <=
// bound, and the sign agrees with the relation. Where a double cannot hold the value it saturates
// and the bound is infinite.
struct Separation {
  double value = 0;
  double bound = 0;
};

// Points of A and B, world frame, that attain the separation: at the distance of each other when
// separated, a common point when touching, and when overlapping those that coincide after the
// shortest translation that ends the overlap. `error`: how far each may be from a point of its hull
// and from attaining the separation. Where several are equally good, one of them.
struct Witness {
  Vector p_WA;
  Vector p_WB;
  double error = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_SEPARATION_H_
