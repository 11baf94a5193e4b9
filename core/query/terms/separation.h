#ifndef HULLD_CORE_QUERY_TERMS_SEPARATION_H_
#define HULLD_CORE_QUERY_TERMS_SEPARATION_H_

#include "core/numeric/vector.h"

namespace hulld {

// The signed separation: the distance if positive; minus the penetration depth, the distance from 0
// to the boundary of A - B, if negative; exactly 0 if touching. |value - true value| <= bound, and
// the sign agrees with the relation. If a double cannot represent the value, it saturates and the
// bound is infinite.
struct Separation {
  double value = 0;
  double bound = 0;
};

// Points of A and B (world frame) that attain the separation. Separated: the nearest points.
// Touching: a common point. Overlapping: points that coincide after the shortest translation that
// ends the overlap. `error` bounds the distance of each point from its hull, and from a point that
// attains the separation. If several pairs are equally good, one of them.
struct Witness {
  Vector p_WA;
  Vector p_WB;
  double error = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_SEPARATION_H_
