#include "tests/oracle/certificate_check.h"

#include <algorithm>

#include "tests/oracle/origin_position.h"

namespace hulld::oracle {
namespace {

// Returns the sign of min n.B - max n.A.
int SignOfGap(const IntegerVector& n, const WorldPoints& points) {
  Integer reach = Dot(n, points.a.front());
  for (const IntegerVector& p : points.a) reach = std::max(reach, Dot(n, p));
  Integer start = Dot(n, points.b.front());
  for (const IntegerVector& p : points.b) start = std::min(start, Dot(n, p));
  return Sign(start - reach);
}

std::string DirectionFault(const Certificate& certificate, int least_gap,
                           const WorldPoints& points) {
  if (certificate.direction.size() != 3) return "no direction";
  const IntegerVector n = {certificate.direction[0], certificate.direction[1],
                           certificate.direction[2]};
  if (IsZero(n)) return "the direction is zero";
  return SignOfGap(n, points) >= least_gap ? "" : "the direction does not separate";
}

}  // namespace

std::string FaultOf(const Certificate& certificate, Relation relation, const WorldPoints& points) {
  std::vector<IntegerVector> differences;
  for (const auto& [a, b] : certificate.pairs) {
    if (a >= points.a.size() || b >= points.b.size()) return "a pair is out of range";
    differences.push_back(Subtract(points.a[a], points.b[b]));
  }
  if (relation == Relation::kSeparated) {
    if (!differences.empty()) return "pairs though separated";
    return DirectionFault(certificate, 1, points);
  }
  if (relation == Relation::kTouching) {
    if (differences.size() > 4) return "more than four pairs";
    if (LocateByPolarCone(differences) == OriginPosition::kOutside) return "0 is not between pairs";
    return DirectionFault(certificate, 0, points);
  }
  if (!certificate.direction.empty()) return "a direction though overlapping";
  if (differences.size() > 6) return "more than six pairs";
  if (LocateByPolarCone(differences) != OriginPosition::kInside) return "0 is not inside the pairs";
  return "";
}

}  // namespace hulld::oracle
