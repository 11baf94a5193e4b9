#include "client/verify/certificate_check.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "client/verify/exact_vector.h"

namespace hulld {
namespace {

// The contract's: Caratheodory's number for a point of the hull and Steinitz's for one inside it.
constexpr int kMostTouchingPairs = 4;
constexpr int kMostOverlappingPairs = 6;
// Coordinates of degree five in doubles have far fewer digits.
constexpr size_t kMostDigits = 100'000;

absl::Status Fails(const std::string& what) { return absl::FailedPreconditionError(what); }

// p_W = (R p + |q|^2 t) / |q|^2 in integers, all lengths at one power of two. That of the
// quaternion cancels.
struct ExactPlacement {
  BigVector rows[3];  // R(q)
  BigInteger scale;   // |q|^2 > 0
  BigVector translation;
  std::vector<BigVector> vertices;

  // |q|^2 p_W.
  BigVector World(const BigVector& p) const {
    return BigVector{Dot(rows[0], p), Dot(rows[1], p), Dot(rows[2], p)} + scale * translation;
  }
};

std::array<double, 4> Rotation(const v1::Pose& pose) {
  if (!pose.has_rotation()) return {1, 0, 0, 0};
  return {pose.rotation().w(), pose.rotation().x(), pose.rotation().y(), pose.rotation().z()};
}

std::array<double, 3> Translation(const v1::Pose& pose) {
  return {pose.translation().x(), pose.translation().y(), pose.translation().z()};
}

absl::Status CheckFinite(std::span<const double> numbers, const char* what) {
  const auto finite = [](double x) { return std::isfinite(x); };
  if (std::all_of(numbers.begin(), numbers.end(), finite)) return absl::OkStatus();
  return Fails(absl::StrCat(what, " holds a number that is not finite"));
}

absl::Status CheckFinite(const PlacedVertices& hull) {
  if (absl::Status s = CheckFinite(hull.xyz, "a hull"); !s.ok()) return s;
  if (absl::Status s = CheckFinite(Translation(hull.pose), "a translation"); !s.ok()) return s;
  const std::array<double, 4> q = Rotation(hull.pose);
  if (absl::Status s = CheckFinite(q, "a rotation"); !s.ok()) return s;
  if (q == std::array<double, 4>{0, 0, 0, 0}) return Fails("a rotation is zero");
  return absl::OkStatus();
}

// lengths: serves the vertices and translations of both hulls.
ExactPlacement MakeExact(const PlacedVertices& hull, const CommonExponent& lengths) {
  const std::array<double, 4> q = Rotation(hull.pose);
  CommonExponent quaternion;
  quaternion.Include(q);
  const BigInteger w = quaternion.ToInteger(q[0]);
  const BigInteger x = quaternion.ToInteger(q[1]);
  const BigInteger y = quaternion.ToInteger(q[2]);
  const BigInteger z = quaternion.ToInteger(q[3]);
  ExactPlacement exact;
  exact.rows[0] = {w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)};
  exact.rows[1] = {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)};
  exact.rows[2] = {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z};
  exact.scale = w * w + x * x + y * y + z * z;
  const std::array<double, 3> t = Translation(hull.pose);
  for (int i = 0; i < 3; ++i) exact.translation[i] = lengths.ToInteger(t[i]);
  for (size_t i = 0; i + 2 < hull.xyz.size(); i += 3) {
    exact.vertices.push_back({lengths.ToInteger(hull.xyz[i]), lengths.ToInteger(hull.xyz[i + 1]),
                              lengths.ToInteger(hull.xyz[i + 2])});
  }
  return exact;
}

absl::Status ReadInteger(const std::string& text, BigInteger* number) {
  const size_t sign = !text.empty() && text[0] == '-' ? 1 : 0;
  const bool digits = std::all_of(text.begin() + static_cast<ptrdiff_t>(sign), text.end(),
                                  [](char c) { return c >= '0' && c <= '9'; });
  if (text.size() == sign || text.size() > kMostDigits || !digits) {
    return Fails("integer_direction holds something else than a decimal integer");
  }
  // A leading 0 would mean octal.
  const size_t first = std::min(text.find_first_not_of('0', sign), text.size() - 1);
  *number = BigInteger(text.substr(first));
  if (sign == 1) *number = -*number;
  return absl::OkStatus();
}

absl::Status ReadDirection(const v1::Certificate& certificate, BigVector* n) {
  switch (certificate.exact_direction_case()) {
    case v1::Certificate::kDirection: {
      const v1::Vector3& d = certificate.direction();
      const std::array<double, 3> numbers = {d.x(), d.y(), d.z()};
      if (absl::Status s = CheckFinite(numbers, "the direction"); !s.ok()) return s;
      CommonExponent exponent;
      exponent.Include(numbers);
      for (int i = 0; i < 3; ++i) (*n)[i] = exponent.ToInteger(numbers[i]);
      break;
    }
    case v1::Certificate::kIntegerDirection: {
      const v1::IntegerDirection& d = certificate.integer_direction();
      if (absl::Status s = ReadInteger(d.x(), &(*n)[0]); !s.ok()) return s;
      if (absl::Status s = ReadInteger(d.y(), &(*n)[1]); !s.ok()) return s;
      if (absl::Status s = ReadInteger(d.z(), &(*n)[2]); !s.ok()) return s;
      break;
    }
    case v1::Certificate::EXACT_DIRECTION_NOT_SET:
      return Fails("the certificate has no direction");
  }
  if (IsZero(*n)) return Fails("the direction is zero");
  return absl::OkStatus();
}

// The least and the greatest of n.p_W over the vertices, times |q|^2.
std::pair<BigInteger, BigInteger> Extent(const ExactPlacement& hull, const BigVector& n) {
  const BigVector turned = n[0] * hull.rows[0] + n[1] * hull.rows[1] + n[2] * hull.rows[2];
  const BigInteger shift = hull.scale * Dot(n, hull.translation);
  BigInteger least = Dot(turned, hull.vertices[0]);
  BigInteger greatest = least;
  for (const BigVector& vertex : hull.vertices) {
    const BigInteger height = Dot(turned, vertex);
    if (height < least) least = height;
    if (height > greatest) greatest = height;
  }
  return {least + shift, greatest + shift};
}

// Sign of min n.B - max n.A.
int GapSign(const ExactPlacement& a, const ExactPlacement& b, const BigVector& n) {
  return (Extent(b, n).first * a.scale - Extent(a, n).second * b.scale).sign();
}

absl::Status CheckVertex(uint32_t index, bool has_vertex, const v1::Vector3& vertex,
                         std::span<const double> xyz, const std::string& name) {
  if (index >= xyz.size() / 3) {
    return Fails(absl::StrCat(name, " is vertex ", index, ", but the hull has ", xyz.size() / 3));
  }
  const double* const p = xyz.data() + 3 * size_t{index};
  if (has_vertex && (vertex.x() != p[0] || vertex.y() != p[1] || vertex.z() != p[2])) {
    return Fails(absl::StrCat(name, " has other coordinates than vertex ", index, " of the hull"));
  }
  return absl::OkStatus();
}

absl::Status CheckPairs(const v1::Certificate& certificate, int most, const PlacedVertices& a,
                        const PlacedVertices& b) {
  if (certificate.pairs_size() > most) {
    return Fails(absl::StrCat("the certificate has ", certificate.pairs_size(),
                              " vertex pairs; its relation allows ", most));
  }
  for (int i = 0; i < certificate.pairs_size(); ++i) {
    const v1::VertexPair& pair = certificate.pairs(i);
    const std::string name = absl::StrCat("pairs[", i, "].");
    absl::Status s =
        CheckVertex(pair.index_a(), pair.has_vertex_a(), pair.vertex_a(), a.xyz, name + "a");
    if (s.ok()) {
      s = CheckVertex(pair.index_b(), pair.has_vertex_b(), pair.vertex_b(), b.xyz, name + "b");
    }
    if (!s.ok()) return s;
  }
  return absl::OkStatus();
}

// Points of A - B, times both scales.
std::vector<BigVector> Differences(const v1::Certificate& certificate, const ExactPlacement& a,
                                   const ExactPlacement& b) {
  std::vector<BigVector> differences;
  for (const v1::VertexPair& pair : certificate.pairs()) {
    differences.push_back(b.scale * a.World(a.vertices[pair.index_a()]) -
                          a.scale * b.World(b.vertices[pair.index_b()]));
  }
  return differences;
}

absl::Status CheckTouching(const v1::Certificate& certificate, const ExactPlacement& a,
                           const ExactPlacement& b) {
  BigVector n;
  if (absl::Status s = ReadDirection(certificate, &n); !s.ok()) return s;
  if (GapSign(a, b, n) < 0) {
    return Fails("the direction does not keep the insides apart: max n.A > min n.B");
  }
  if (HoldsOriginOnBoundary(Differences(certificate, a, b))) return absl::OkStatus();
  return Fails("the vertex pairs show no common point: 0 is not in the hull of their differences");
}

}  // namespace

absl::Status CheckCertificate(v1::Relation relation, const v1::Certificate& certificate,
                              const PlacedVertices& a, const PlacedVertices& b) {
  if (relation != v1::RELATION_SEPARATED && relation != v1::RELATION_TOUCHING &&
      relation != v1::RELATION_OVERLAPPING) {
    return Fails(absl::StrCat(v1::Relation_Name(relation), " has no certificate"));
  }
  if (a.xyz.empty() || b.xyz.empty()) {
    if (relation == v1::RELATION_SEPARATED) return absl::OkStatus();
    return Fails("a hull is empty, and so separated from everything");
  }
  for (const PlacedVertices* hull : {&a, &b}) {
    if (absl::Status s = CheckFinite(*hull); !s.ok()) return s;
  }
  if (relation != v1::RELATION_SEPARATED) {
    const int most =
        relation == v1::RELATION_OVERLAPPING ? kMostOverlappingPairs : kMostTouchingPairs;
    if (absl::Status s = CheckPairs(certificate, most, a, b); !s.ok()) return s;
  }

  CommonExponent lengths;
  for (const PlacedVertices* hull : {&a, &b}) {
    lengths.Include(hull->xyz);
    lengths.Include(Translation(hull->pose));
  }
  const ExactPlacement exact_a = MakeExact(a, lengths);
  const ExactPlacement exact_b = MakeExact(b, lengths);
  if (relation == v1::RELATION_TOUCHING) return CheckTouching(certificate, exact_a, exact_b);
  if (relation == v1::RELATION_OVERLAPPING) {
    if (HoldsOriginInside(Differences(certificate, exact_a, exact_b))) return absl::OkStatus();
    return Fails("0 is not inside the hull of the differences of the vertex pairs");
  }
  BigVector n;
  if (absl::Status s = ReadDirection(certificate, &n); !s.ok()) return s;
  if (GapSign(exact_a, exact_b, n) > 0) return absl::OkStatus();
  return Fails("the direction does not separate: max n.A >= min n.B");
}

}  // namespace hulld
