#ifndef HULLD_TESTS_ORACLE_CERTIFICATE_CHECK_H_
#define HULLD_TESTS_ORACLE_CERTIFICATE_CHECK_H_

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/oracle/brute_force_relation.h"
#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Certificate as received by a client: a direction, empty if absent, and pairs of a vertex of A and
// a vertex of B.
struct Certificate {
  std::vector<Integer> direction;
  std::vector<std::pair<uint32_t, uint32_t>> pairs;
};

// Returns the defect of a certificate of a relation, or an empty string if it proves the relation.
// Exact, from the certificate alone. SEPARATED: max n.A < min n.B, no pairs. TOUCHING: n not zero,
// max n.A <= min n.B, and at most four pairs, with 0 in the hull of their differences. OVERLAPPING:
// no direction, and at most six pairs, with 0 strictly inside the hull of their differences.
std::string FaultOf(const Certificate& certificate, Relation relation, const WorldPoints& points);

// Like FaultOf, but for hulls with radii, at least one of them not 0. `radii`: their exact sum is
// r.
std::string FaultOfRounded(const Certificate& certificate, Relation relation,
                           std::span<const Point> a, const Placement& X_WA,
                           std::span<const Point> b, const Placement& X_WB,
                           std::span<const double> radii);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_CERTIFICATE_CHECK_H_
