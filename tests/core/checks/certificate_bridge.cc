#include "tests/core/checks/certificate_bridge.h"

#include <string>
#include <variant>

#include "tests/core/checks/oracle_bridge.h"

namespace hulld {
namespace {

oracle::Integer ToOracle(const Integer& value) { return static_cast<oracle::Integer>(value); }

oracle::Relation ToOracle(Relation relation) {
  switch (relation) {
    case Relation::kTouching:
      return oracle::Relation::kTouching;
    case Relation::kOverlapping:
      return oracle::Relation::kOverlapping;
    case Relation::kSeparated:
    case Relation::kWithinTolerance:
      break;
  }
  return oracle::Relation::kSeparated;
}

}  // namespace

oracle::Certificate ToOracle(const Certificate& certificate) {
  oracle::Certificate result;
  if (const Vector* n = std::get_if<Vector>(&certificate.direction)) {
    const double components[] = {n->x(), n->y(), n->z()};
    result.direction = oracle::ToIntegers(components);
  }
  if (const IntegerVector* n = std::get_if<IntegerVector>(&certificate.direction)) {
    for (int i = 0; i < 3; ++i) result.direction.push_back(ToOracle((*n)[i]));
  }
  for (const VertexPair& pair : certificate.pairs) result.pairs.emplace_back(pair.a, pair.b);
  return result;
}

testing::AssertionResult CertificateIsValid(const Hull& a, const Pose& X_WA, const Hull& b,
                                            const Pose& X_WB, const Answer& answer) {
  const bool expected = !a.empty() && !b.empty();
  if (answer.certificate.has_value() != expected) {
    return testing::AssertionFailure()
           << "the certificate is missing, or exists although a hull is empty";
  }
  if (!expected) return testing::AssertionSuccess();
  const oracle::WorldPoints points = oracle::PlaceInWorld(ToOracle(a.vertices()), ToOracle(X_WA),
                                                          ToOracle(b.vertices()), ToOracle(X_WB));
  const std::string fault =
      oracle::FaultOf(ToOracle(*answer.certificate), ToOracle(answer.relation), points);
  if (fault.empty()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "certificate of " << Name(answer.relation) << ": " << fault;
}

}  // namespace hulld
