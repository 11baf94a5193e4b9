#include "client/verify/certificate_check.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "client/base/status_macros.h"

namespace hulld {
namespace {

// Limit of the contract: Steinitz's number for an interior point.
constexpr int kMaxOverlappingPairs = 6;
// Far above the digits of a cross product of coordinates of degree nine in doubles.
constexpr size_t kMaxDigits = 100'000;

absl::Status ReadInteger(const std::string& text, BigInteger* number) {
  const size_t sign = !text.empty() && text[0] == '-' ? 1 : 0;
  const bool digits = std::all_of(text.begin() + static_cast<ptrdiff_t>(sign), text.end(),
                                  [](char c) { return c >= '0' && c <= '9'; });
  if (text.size() == sign || text.size() > kMaxDigits || !digits) {
    return ProofFails("integer_direction is not a decimal integer");
  }
  // Boost would parse a leading 0 as octal.
  const size_t first = std::min(text.find_first_not_of('0', sign), text.size() - 1);
  *number = BigInteger(text.substr(first));
  if (sign == 1) *number = -*number;
  return absl::OkStatus();
}

absl::Status CheckVertex(uint32_t index, bool has_vertex, const v1::Vector3& vertex,
                         const ExactHull& hull, const std::string& name) {
  const std::span<const double> xyz = hull.xyz;
  if (index >= xyz.size() / 3 && hull.in_any_order) {
    return ProofFails(absl::StrCat(name, " is not one of the points of its inline shape"));
  }
  if (index >= xyz.size() / 3) {
    return ProofFails(
        absl::StrCat(name, " is vertex ", index, ", but the hull has ", xyz.size() / 3));
  }
  const double* const p = xyz.data() + 3 * size_t{index};
  if (has_vertex && (vertex.x() != p[0] || vertex.y() != p[1] || vertex.z() != p[2])) {
    return ProofFails(
        absl::StrCat(name, " does not have the coordinates of vertex ", index, " of the hull"));
  }
  return absl::OkStatus();
}

// Sets the index of a vertex to that of the point with its coordinates. Leaves an index out of
// range if there is none.
void Locate(const v1::Vector3& vertex, std::span<const double> xyz, uint32_t* index) {
  for (*index = 0; *index < xyz.size() / 3; ++*index) {
    const double* const p = xyz.data() + 3 * size_t{*index};
    if (vertex.x() == p[0] && vertex.y() == p[1] && vertex.z() == p[2]) return;
  }
}

// Returns the certificate with indices into the points of hulls in any order.
v1::Certificate Located(v1::Certificate certificate, const ExactHull& a, const ExactHull& b) {
  for (v1::VertexPair& pair : *certificate.mutable_pairs()) {
    uint32_t index_a = pair.index_a();
    uint32_t index_b = pair.index_b();
    if (a.in_any_order) Locate(pair.vertex_a(), a.xyz, &index_a);
    if (b.in_any_order) Locate(pair.vertex_b(), b.xyz, &index_b);
    pair.set_index_a(index_a);
    pair.set_index_b(index_b);
  }
  return certificate;
}

absl::Status CheckPairs(const v1::Certificate& certificate, int max_pairs, const ExactHull& a,
                        const ExactHull& b) {
  if (certificate.pairs_size() > max_pairs) {
    return ProofFails(absl::StrCat("the certificate has ", certificate.pairs_size(),
                                   " vertex pairs; its relation allows ", max_pairs));
  }
  for (int i = 0; i < certificate.pairs_size(); ++i) {
    const v1::VertexPair& pair = certificate.pairs(i);
    const std::string name = absl::StrCat("pairs[", i, "].");
    HULLD_RETURN_IF_ERROR(
        CheckVertex(pair.index_a(), pair.has_vertex_a(), pair.vertex_a(), a, name + "a"));
    HULLD_RETURN_IF_ERROR(
        CheckVertex(pair.index_b(), pair.has_vertex_b(), pair.vertex_b(), b, name + "b"));
  }
  return absl::OkStatus();
}

absl::Status CheckTouching(const v1::Certificate& certificate, const ExactHull& a,
                           const ExactHull& b) {
  HULLD_ASSIGN_OR_RETURN(const auto differences,
                         DifferencesOf(certificate, kMaxTouchingPairs, a, b));
  BigVector n;
  HULLD_RETURN_IF_ERROR(ReadDirection(certificate, &n));
  if (GapSign(a, b, n) < 0) {
    return ProofFails("the direction does not separate the interiors: max n.A > min n.B");
  }
  if (ContainsOriginOnBoundary(differences)) return absl::OkStatus();
  return ProofFails(
      "the vertex pairs show no common point: 0 is not in the hull of their differences");
}

absl::Status CheckOverlapping(const v1::Certificate& certificate, const ExactHull& a,
                              const ExactHull& b) {
  HULLD_ASSIGN_OR_RETURN(const auto differences,
                         DifferencesOf(certificate, kMaxOverlappingPairs, a, b));
  if (ContainsOriginInside(differences)) return absl::OkStatus();
  return ProofFails("0 is not inside the hull of the differences of the vertex pairs");
}

// The sum of the radii at the scale of A - B: times both scales.
BigInteger RadiiOf(const ExactHull& a, const ExactHull& b) {
  return (a.radius + b.radius) * a.scale * b.scale;
}

// CheckExactly for hulls with radii, not both 0.
absl::Status CheckRounded(v1::Relation relation, const v1::Certificate& certificate,
                          const ExactHull& a, const ExactHull& b) {
  const bool is_separated = relation == v1::RELATION_SEPARATED;
  const bool is_touching = relation == v1::RELATION_TOUCHING;
  if (is_separated || is_touching) {
    BigVector n;
    HULLD_RETURN_IF_ERROR(ReadDirection(certificate, &n));
    if (GapSign(a, b, n) < (is_separated ? 1 : 0)) {
      return ProofFails(
          "the gap between the hulls along the direction is too small for their radii");
    }
    if (is_separated) return absl::OkStatus();
  }
  HULLD_ASSIGN_OR_RETURN(
      const auto differences,
      DifferencesOf(certificate, is_touching ? kMaxTouchingPairs : kMaxOverlappingPairs, a, b));
  const BigInteger r = RadiiOf(a, b);
  if (ComesWithin(differences, r * r, /*nearer=*/!is_touching)) return absl::OkStatus();
  return ProofFails(
      "the hull of the differences of the vertex pairs is too far from 0 for the radii");
}

}  // namespace

absl::Status ReadDirection(const v1::Certificate& certificate, BigVector* n, int* exponent) {
  int of_integers = 0;
  switch (certificate.exact_direction_case()) {
    case v1::Certificate::kDirection: {
      const v1::Vector3& d = certificate.direction();
      const std::array<double, 3> numbers = {d.x(), d.y(), d.z()};
      if (!AreFinite(numbers))
        return ProofFails("the direction contains a number that is not finite");
      CommonExponent common;
      common.Include(numbers);
      for (int i = 0; i < 3; ++i) (*n)[i] = common.ToInteger(numbers[i]);
      of_integers = common.exponent();
      break;
    }
    case v1::Certificate::kIntegerDirection: {
      const v1::IntegerDirection& d = certificate.integer_direction();
      HULLD_RETURN_IF_ERROR(ReadInteger(d.x(), &(*n)[0]));
      HULLD_RETURN_IF_ERROR(ReadInteger(d.y(), &(*n)[1]));
      HULLD_RETURN_IF_ERROR(ReadInteger(d.z(), &(*n)[2]));
      break;
    }
    case v1::Certificate::EXACT_DIRECTION_NOT_SET:
      return ProofFails("the certificate has no direction");
  }
  if (IsZero(*n)) return ProofFails("the direction is zero");
  if (exponent != nullptr) *exponent = of_integers;
  return absl::OkStatus();
}

int GapSign(const ExactHull& a, const ExactHull& b, const BigVector& n) {
  const BigInteger gap = b.Extent(n).first * a.scale - a.Extent(n).second * b.scale;
  const BigInteger r = RadiiOf(a, b);
  if (r == 0 || gap < 0) return gap.sign();
  return BigInteger(gap * gap - r * r * Dot(n, n)).sign();
}

absl::Status ProofFails(const std::string& reason) { return absl::FailedPreconditionError(reason); }

absl::Status CheckRelation(v1::Relation relation) {
  if (relation == v1::RELATION_SEPARATED || relation == v1::RELATION_TOUCHING ||
      relation == v1::RELATION_OVERLAPPING) {
    return absl::OkStatus();
  }
  return ProofFails(absl::StrCat(v1::Relation_Name(relation), " has no certificate"));
}

absl::StatusOr<std::vector<BigVector>> DifferencesOf(const v1::Certificate& certificate,
                                                     int max_pairs, const ExactHull& a,
                                                     const ExactHull& b) {
  const v1::Certificate located = Located(certificate, a, b);
  HULLD_RETURN_IF_ERROR(CheckPairs(located, max_pairs, a, b));
  std::vector<BigVector> differences;
  for (const v1::VertexPair& pair : located.pairs()) {
    differences.push_back(b.scale * a.World(pair.index_a()) - a.scale * b.World(pair.index_b()));
  }
  return differences;
}

absl::Status CheckExactly(v1::Relation relation, const v1::Certificate& certificate,
                          const ExactHull& a, const ExactHull& b) {
  HULLD_RETURN_IF_ERROR(CheckRelation(relation));
  if (a.radius + b.radius > 0) return CheckRounded(relation, certificate, a, b);
  if (relation == v1::RELATION_TOUCHING) return CheckTouching(certificate, a, b);
  if (relation == v1::RELATION_OVERLAPPING) return CheckOverlapping(certificate, a, b);
  BigVector n;
  HULLD_RETURN_IF_ERROR(ReadDirection(certificate, &n));
  if (GapSign(a, b, n) > 0) return absl::OkStatus();
  return ProofFails("the direction does not separate: max n.A >= min n.B");
}

absl::Status CheckCertificate(v1::Relation relation, const v1::Certificate& certificate,
                              const PlacedVertices& a, const PlacedVertices& b) {
  HULLD_RETURN_IF_ERROR(CheckRelation(relation));
  if (a.xyz.empty() || b.xyz.empty()) {
    if (relation == v1::RELATION_SEPARATED) return absl::OkStatus();
    return ProofFails("a hull is empty, and so separated from everything");
  }
  CommonExponent lengths;
  for (const PlacedVertices* hull : {&a, &b}) {
    HULLD_RETURN_IF_ERROR(CheckPlacement(*hull));
    IncludeLengths(*hull, &lengths);
  }
  return CheckExactly(relation, certificate, ExactHull(a, ToIntegers(a.xyz, lengths), lengths),
                      ExactHull(b, ToIntegers(b.xyz, lengths), lengths));
}

}  // namespace hulld
