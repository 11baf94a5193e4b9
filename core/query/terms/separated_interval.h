#ifndef HULLD_CORE_QUERY_TERMS_SEPARATED_INTERVAL_H_
#define HULLD_CORE_QUERY_TERMS_SEPARATED_INTERVAL_H_

#include <optional>
#include <variant>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"

namespace hulld {

// Proof that a pair is separated from the end of the previous interval, or 0, up to `until`. The
// direction n (world frame, from A toward B, not zero, of any length) and the offset are exact as
// given.
//
// With an offset: n.p < offset - radius_A |n| for all points p of A, and n.p > offset + radius_B
// |n| for all p of B. With an end, n and the offset change linearly in t from the start of the
// interval to `until`, and |n| is replaced by the length of the longer direction, which bounds it.
// For a vertex v, |q(t)|^2 (n.p(t) - offset) is a polynomial in t of degree 4, and its Bernstein
// coefficients over the interval all have this sign.
// Without an offset, for translations: n.(b(t) - a(t)) > (radius_A + radius_B) |n| for all vertices
// a and b at both ends, where equality is allowed at `until` of the last interval before a contact.
struct SeparatedInterval {
  struct End {
    Vector direction;
    double offset;
  };

  double until = 1;
  std::variant<Vector, IntegerVector> direction;
  std::optional<double> offset;
  std::optional<End> end = {};
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_SEPARATED_INTERVAL_H_
