#include "client/verify/exact_hull.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "client/base/check.h"
#include "client/base/status_macros.h"

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
  return absl::FailedPreconditionError(absl::StrCat(what, " contains a number that is not finite"));
}

absl::Status CheckPose(const v1::Pose& pose) {
  HULLD_RETURN_IF_ERROR(CheckFinite(Translation(pose), "a translation"));
  const std::array<double, 4> q = Rotation(pose);
  HULLD_RETURN_IF_ERROR(CheckFinite(q, "a rotation"));
  if (q != std::array<double, 4>{0, 0, 0, 0}) return absl::OkStatus();
  return absl::FailedPreconditionError("a rotation is zero");
}

BigVector ToIntegers(const std::array<double, 3>& t, const CommonExponent& lengths) {
  return {lengths.ToInteger(t[0]), lengths.ToInteger(t[1]), lengths.ToInteger(t[2])};
}

// R(q) and |q|^2.
BigRotation ExactRotation(const v1::Pose& pose) {
  CommonExponent quaternion;
  IncludeRotation(pose, &quaternion);
  const BigQuaternion q = RotationIn(pose, quaternion);
  return RotationForm(q, q);
}

BigVector Product(const BigVector (&rows)[3], const BigVector& p) {
  return {Dot(rows[0], p), Dot(rows[1], p), Dot(rows[2], p)};
}

}  // namespace

// Every entry of R(q) and |q|^2 is a sum of products of two components. A product x y becomes (x y'
// + x' y) / 2; off its diagonal, R(q) contains only doubled products of different components.
BigRotation RotationForm(const BigQuaternion& a, const BigQuaternion& b) {
  const auto square = [&](int i) -> BigInteger { return a[i] * b[i]; };
  const auto twice = [&](int i, int j) -> BigInteger { return a[i] * b[j] + a[j] * b[i]; };
  const BigInteger ww = square(0);
  const BigInteger xx = square(1);
  const BigInteger yy = square(2);
  const BigInteger zz = square(3);
  return {{{ww + xx - yy - zz, twice(1, 2) - twice(0, 3), twice(1, 3) + twice(0, 2)},
           {twice(1, 2) + twice(0, 3), ww - xx + yy - zz, twice(2, 3) - twice(0, 1)},
           {twice(1, 3) - twice(0, 2), twice(2, 3) + twice(0, 1), ww - xx - yy + zz}},
          ww + xx + yy + zz};
}

BigQuaternion RotationIn(const v1::Pose& pose, const CommonExponent& quaternions) {
  const std::array<double, 4> q = Rotation(pose);
  return {quaternions.ToInteger(q[0]), quaternions.ToInteger(q[1]), quaternions.ToInteger(q[2]),
          quaternions.ToInteger(q[3])};
}

BigVector TranslationIn(const v1::Pose& pose, const CommonExponent& lengths) {
  return ToIntegers(Translation(pose), lengths);
}

void IncludeRotation(const v1::Pose& pose, CommonExponent* quaternions) {
  quaternions->Include(Rotation(pose));
}

BigVector Combination(const BigVector& n, const BigVector (&rows)[3]) {
  return n[0] * rows[0] + n[1] * rows[1] + n[2] * rows[2];
}

bool AreFinite(std::span<const double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

absl::Status CheckPlacement(const PlacedVertices& hull) {
  HULLD_RETURN_IF_ERROR(CheckFinite(hull.xyz, "a hull"));
  HULLD_RETURN_IF_ERROR(CheckPose(hull.pose));
  HULLD_RETURN_IF_ERROR(CheckFinite(hull.radii, "a radius"));
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
ExactHull::ExactHull(const PlacedVertices& hull, BigVertices exact_vertices,
                     const CommonExponent& lengths)
    : xyz(hull.xyz), in_any_order(hull.in_any_order), vertices(std::move(exact_vertices)) {
  HULLD_CLIENT_CHECK(vertices != nullptr && vertices->size() == xyz.size() / 3);
  radius = lengths.ToInteger(hull.radii[0]) + lengths.ToInteger(hull.radii[1]);
  const BigRotation outer = ExactRotation(hull.pose);
  const BigVector t = TranslationIn(hull.pose, lengths);
  if (hull.in_body == nullptr) {
    std::copy(outer.rows, outer.rows + 3, rows);
    scale = outer.scale;
    shift = scale * t;
    return;
  }
  const BigRotation inner = ExactRotation(*hull.in_body);
  const BigVector t_P = TranslationIn(*hull.in_body, lengths);
  for (int i = 0; i < 3; ++i) rows[i] = Combination(outer.rows[i], inner.rows);
  scale = outer.scale * inner.scale;
  shift = inner.scale * Product(outer.rows, t_P) + scale * t;
}

ExactHull::ExactHull(const PlacedVertices& hull, BigVertices exact_vertices,
                     const CommonExponent& lengths, const BigRotation& rotation,
                     const BigVector& translation, const BigInteger& divisor)
    : xyz(hull.xyz),
      in_any_order(hull.in_any_order),
      vertices(std::move(exact_vertices)),
      radius(lengths.ToInteger(hull.radii[0]) + lengths.ToInteger(hull.radii[1])) {
  HULLD_CLIENT_CHECK(vertices != nullptr && vertices->size() == xyz.size() / 3);
  for (int i = 0; i < 3; ++i) rows[i] = divisor * rotation.rows[i];
  scale = divisor * rotation.scale;
  shift = rotation.scale * translation;
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
