#include "client/verify/exact_hull.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "client/check.h"

namespace hulld {
namespace {

std::array<double, 4> Rotation(const v1::Pose& pose) {
  if (!pose.has_rotation()) return {1, 0, 0, 0};
  return {pose.rotation().w(), pose.rotation().x(), pose.rotation().y(), pose.rotation().z()};
}

std::array<double, 3> Translation(const v1::Pose& pose) {
  return {pose.translation().x(), pose.translation().y(), pose.translation().z()};
}

absl::Status CheckFinite(std::span<const double> numbers, const char* what) {
  if (AreFinite(numbers)) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(what, " holds a number that is not finite"));
}

absl::Status CheckPose(const v1::Pose& pose) {
  if (absl::Status s = CheckFinite(Translation(pose), "a translation"); !s.ok()) return s;
  const std::array<double, 4> q = Rotation(pose);
  if (absl::Status s = CheckFinite(q, "a rotation"); !s.ok()) return s;
  if (q != std::array<double, 4>{0, 0, 0, 0}) return absl::OkStatus();
  return absl::FailedPreconditionError("a rotation is zero");
}

// R(q) and |q|^2.
struct BigRotation {
  BigVector rows[3];
  BigInteger scale;
};

BigRotation ToIntegers(const std::array<double, 4>& q) {
  CommonExponent quaternion;
  quaternion.Include(q);
  const BigInteger w = quaternion.ToInteger(q[0]);
  const BigInteger x = quaternion.ToInteger(q[1]);
  const BigInteger y = quaternion.ToInteger(q[2]);
  const BigInteger z = quaternion.ToInteger(q[3]);
  return {{{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}},
          w * w + x * x + y * y + z * z};
}

BigVector ToIntegers(const std::array<double, 3>& t, const CommonExponent& lengths) {
  return {lengths.ToInteger(t[0]), lengths.ToInteger(t[1]), lengths.ToInteger(t[2])};
}

// n^T M.
BigVector Combination(const BigVector& n, const BigVector (&rows)[3]) {
  return n[0] * rows[0] + n[1] * rows[1] + n[2] * rows[2];
}

BigVector Product(const BigVector (&rows)[3], const BigVector& p) {
  return {Dot(rows[0], p), Dot(rows[1], p), Dot(rows[2], p)};
}

}  // namespace

bool AreFinite(std::span<const double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

absl::Status CheckPlacement(const PlacedVertices& hull) {
  if (absl::Status s = CheckFinite(hull.xyz, "a hull"); !s.ok()) return s;
  if (absl::Status s = CheckPose(hull.pose); !s.ok()) return s;
  if (absl::Status s = CheckFinite(hull.radii, "a radius"); !s.ok()) return s;
  if (hull.radii[0] < 0 || hull.radii[1] < 0) {
    return absl::FailedPreconditionError("a radius is negative");
  }
  return hull.in_body == nullptr ? absl::OkStatus() : CheckPose(*hull.in_body);
}

void IncludeLengths(const PlacedVertices& hull, CommonExponent* lengths) {
  lengths->Include(hull.xyz);
  lengths->Include(Translation(hull.pose));
  if (hull.in_body != nullptr) lengths->Include(Translation(*hull.in_body));
  lengths->Include(hull.radii);
}

BigVertices ToIntegers(std::span<const double> xyz, const CommonExponent& lengths) {
  std::vector<BigVector> vertices;
  vertices.reserve(xyz.size() / 3);
  for (size_t i = 0; i + 2 < xyz.size(); i += 3) {
    vertices.push_back(ToIntegers(std::array{xyz[i], xyz[i + 1], xyz[i + 2]}, lengths));
  }
  return std::make_shared<const std::vector<BigVector>>(std::move(vertices));
}

// p_W = R(q) p / |q|^2 + t, and for a piece R(q_B) (R(q_P) p / |q_P|^2 + t_P) / |q_B|^2 + t_B.
ExactHull::ExactHull(const PlacedVertices& hull, BigVertices given, const CommonExponent& lengths)
    : xyz(hull.xyz), in_any_order(hull.in_any_order), vertices(std::move(given)) {
  HULLD_CLIENT_CHECK(vertices != nullptr && vertices->size() == xyz.size() / 3);
  radius = lengths.ToInteger(hull.radii[0]) + lengths.ToInteger(hull.radii[1]);
  const BigRotation outer = ToIntegers(Rotation(hull.pose));
  const BigVector t = ToIntegers(Translation(hull.pose), lengths);
  if (hull.in_body == nullptr) {
    std::copy(outer.rows, outer.rows + 3, rows);
    scale = outer.scale;
    shift = scale * t;
    return;
  }
  const BigRotation inner = ToIntegers(Rotation(*hull.in_body));
  const BigVector t_P = ToIntegers(Translation(*hull.in_body), lengths);
  for (int i = 0; i < 3; ++i) rows[i] = Combination(outer.rows[i], inner.rows);
  scale = outer.scale * inner.scale;
  shift = inner.scale * Product(outer.rows, t_P) + scale * t;
}

BigVector ExactHull::World(size_t i) const { return Product(rows, (*vertices)[i]) + shift; }

std::pair<BigInteger, BigInteger> ExactHull::Extent(const BigVector& n) const {
  HULLD_CLIENT_CHECK(!vertices->empty());
  const BigVector turned = Combination(n, rows);
  BigInteger least = Dot(turned, vertices->front());
  BigInteger greatest = least;
  for (const BigVector& vertex : *vertices) {
    const BigInteger height = Dot(turned, vertex);
    if (height < least) least = height;
    if (height > greatest) greatest = height;
  }
  const BigInteger shifted = Dot(n, shift);
  return {least + shifted, greatest + shifted};
}

}  // namespace hulld
