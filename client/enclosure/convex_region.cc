#include "client/enclosure/convex_region.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <utility>

#include "client/enclosure/exact_number.h"

namespace hulld {
namespace {

using Point = std::array<double, 3>;

// Proven: each number of normal and offset has a relative error of at most 2^-51; three products
// and three sums add at most 2^-50 of the sum of all magnitudes. This bound exceeds both.
constexpr double kFilterError = 0x1p-48;
// Within these bounds, no product or sum of the filter overflows or loses digits to underflow.
constexpr double kMinSize = 0x1p-800;
constexpr double kMaxSize = 0x1p800;
constexpr double kMinNormal = 0x1p-500;

Point PointAt(const std::vector<double>& xyz, size_t i) {
  return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
}

BigVector Negative(const BigVector& v) { return {-v[0], -v[1], -v[2]}; }

// Computes the half spaces of a hull from its vertices on the grid.
class HalfSpaceMaker {
 public:
  HalfSpaceMaker(const std::vector<BigVector>& vertices, const CommonExponent& grid)
      : vertices_(vertices), grid_(grid) {}

  // normal . p <= normal . through.
  void Add(const BigVector& normal, const BigVector& through) {
    if (IsZero(normal)) return;
    made_.emplace_back(normal, Dot(normal, through), grid_);
  }
  // normal . p = normal . through.
  void AddBoth(const BigVector& normal, const BigVector& through) {
    Add(normal, through);
    Add(Negative(normal), through);
  }

  // Returns the normal of a facet, outward if its vertices turn counter-clockwise. Determined by
  // the first corner that is not straight.
  BigVector NormalOf(std::span<const uint32_t> facet) const {
    for (size_t i = 2; i < facet.size(); ++i) {
      const BigVector& a = vertices_[facet[0]];
      BigVector normal = Cross(vertices_[facet[i - 1]] - a, vertices_[facet[i]] - a);
      if (!IsZero(normal)) return normal;
    }
    return {0, 0, 0};
  }

  void AddPolygon(std::span<const uint32_t> facet) {
    const BigVector normal = NormalOf(facet);
    AddBoth(normal, vertices_[facet[0]]);
    for (size_t i = 0; i < facet.size(); ++i) {
      const BigVector& from = vertices_[facet[i]];
      const BigVector& to = vertices_[facet[(i + 1) % facet.size()]];
      Add(Cross(to - from, normal), from);
    }
  }

  void AddSegment(const BigVector& a, const BigVector& b) {
    const BigVector along = b - a;
    for (const BigVector& axis : {BigVector{1, 0, 0}, BigVector{0, 1, 0}, BigVector{0, 0, 1}}) {
      AddBoth(Cross(along, axis), a);
    }
    Add(along, b);
    Add(Negative(along), a);
  }

  void AddPoint(const BigVector& a) {
    for (const BigVector& axis : {BigVector{1, 0, 0}, BigVector{0, 1, 0}, BigVector{0, 0, 1}}) {
      AddBoth(axis, a);
    }
  }

  std::vector<HalfSpace> Take() { return std::move(made_); }

 private:
  const std::vector<BigVector>& vertices_;
  const CommonExponent& grid_;
  std::vector<HalfSpace> made_;
};

// Converts half spaces of a hull in its own frame H to the world frame W.
//
// With an integer quaternion, the rotation is M / D: M consists of products of two of its numbers,
// D is the sum of their squares. A point P of W is M^T (P - T) / D in H, so that n . p_H <= o is (M
// n) . P <= D o + (M n) . T.
class HalfSpaceMover {
 public:
  HalfSpaceMover(const RigidPose& X_WH, const CommonExponent& grid)
      : grid_(grid), T_(OnGrid({X_WH[4], X_WH[5], X_WH[6]}, grid)) {
    CommonExponent quaternion;
    quaternion.Include(std::span(X_WH).first(4));
    const BigInteger w = quaternion.ToInteger(X_WH[0]);
    const BigInteger x = quaternion.ToInteger(X_WH[1]);
    const BigInteger y = quaternion.ToInteger(X_WH[2]);
    const BigInteger z = quaternion.ToInteger(X_WH[3]);
    M_ = {BigVector{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
          BigVector{2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
          BigVector{2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
    D_ = w * w + x * x + y * y + z * z;
  }

  HalfSpace Move(const HalfSpace& half) const {
    const BigVector normal = {Dot(M_[0], half.normal()), Dot(M_[1], half.normal()),
                              Dot(M_[2], half.normal())};
    return HalfSpace(normal, D_ * half.offset() + Dot(normal, T_), grid_);
  }

 private:
  const CommonExponent& grid_;
  const BigVector T_;
  std::array<BigVector, 3> M_;
  BigInteger D_;
};

}  // namespace

HalfSpace::HalfSpace(BigVector normal, BigInteger offset, const CommonExponent& grid)
    : normal_(std::move(normal)), offset_(std::move(offset)) {
  int bits = 0;
  for (const BigInteger& x : normal_) {
    if (x != 0) bits = std::max(bits, static_cast<int>(boost::multiprecision::msb(abs(x))) + 1);
  }
  for (size_t i = 0; i < 3; ++i) unit_normal_[i] = Approximate(normal_[i], -bits);
  unit_offset_ = Approximate(offset_, grid.exponent() - bits);
  // Without a finite offset, the filter decides nothing.
  for (size_t i = 0; i < 3; ++i) {
    if (normal_[i] != 0 && std::abs(unit_normal_[i]) < kMinNormal) unit_offset_ = HUGE_VAL;
  }
}

int HalfSpace::Side(const Point& p, const BigVector& P) const {
  const double x = unit_normal_[0] * p[0];
  const double y = unit_normal_[1] * p[1];
  const double z = unit_normal_[2] * p[2];
  const double height = x + y + z - unit_offset_;
  const double size = std::abs(x) + std::abs(y) + std::abs(z) + std::abs(unit_offset_);
  if (size > kMinSize && size < kMaxSize) {
    if (height > kFilterError * size) return 1;
    if (height < -kFilterError * size) return -1;
  }
  return (Dot(normal_, P) - offset_).sign();
}

absl::StatusOr<ConvexRegion> ConvexRegion::Make(const HullMesh& mesh, const CommonExponent& grid) {
  std::vector<BigVector> vertices;
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    vertices.push_back(OnGrid(PointAt(mesh.xyz, i), grid));
  }
  ConvexRegion region;
  HalfSpaceMaker maker(vertices, grid);
  region.empty_ = vertices.empty();
  if (vertices.size() == 1) maker.AddPoint(vertices[0]);
  if (vertices.size() == 2) maker.AddSegment(vertices[0], vertices[1]);
  const bool is_flat = mesh.facet_sizes.size() == 1;
  if (vertices.size() > 2 && mesh.facet_sizes.empty()) {
    return absl::InternalError("a hull of more than two vertices has no facets");
  }
  size_t begin = 0;
  for (const uint32_t size : mesh.facet_sizes) {
    const bool fits = size >= 3 && begin + size <= mesh.facet_indices.size();
    const auto facet =
        fits ? std::span(mesh.facet_indices).subspan(begin, size) : std::span<const uint32_t>();
    const auto is_vertex = [&](uint32_t index) { return index < vertices.size(); };
    if (!fits || !std::all_of(facet.begin(), facet.end(), is_vertex)) {
      return absl::InternalError("a facet of the hull does not match its vertices");
    }
    if (is_flat) {
      maker.AddPolygon(facet);
    } else {
      maker.Add(maker.NormalOf(facet), vertices[facet[0]]);
    }
    begin += size;
  }
  region.half_spaces_ = maker.Take();
  return region;
}

absl::StatusOr<ConvexRegion> ConvexRegion::Make(const HullMesh& mesh, const RigidPose& X_WH,
                                                const CommonExponent& grid) {
  auto region = Make(mesh, grid);
  if (!region.ok() || X_WH == kNoMotion) return region;
  const HalfSpaceMover mover(X_WH, grid);
  for (HalfSpace& half : region->half_spaces_) half = mover.Move(half);
  return region;
}

bool ConvexRegion::Contains(const Point& p, const BigVector& P) const {
  return !empty_ && std::all_of(half_spaces_.begin(), half_spaces_.end(),
                                [&](const HalfSpace& half) { return half.Side(p, P) <= 0; });
}

BigVector OnGrid(const Point& p, const CommonExponent& grid) {
  return {grid.ToInteger(p[0]), grid.ToInteger(p[1]), grid.ToInteger(p[2])};
}

absl::StatusOr<bool> IsHullOf(const HullMesh& mesh, const std::vector<double>& xyz) {
  CommonExponent grid;
  grid.Include(mesh.xyz);
  grid.Include(xyz);
  const auto region = ConvexRegion::Make(mesh, grid);
  if (!region.ok()) return region.status();
  std::set<Point> missing;
  // Adding 0 turns -0 into 0.
  const auto key = [](const Point& p) { return Point{p[0] + 0, p[1] + 0, p[2] + 0}; };
  for (size_t i = 0; i < mesh.vertex_count(); ++i) missing.insert(key(PointAt(mesh.xyz, i)));
  for (size_t i = 0; i < xyz.size() / 3; ++i) {
    const Point p = PointAt(xyz, i);
    // Vertices need no test.
    if (missing.erase(key(p)) > 0) continue;
    if (!region->Contains(p, OnGrid(p, grid))) return false;
  }
  return missing.empty();
}

}  // namespace hulld
