#include "core/query/exact/lattice_contact.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/base/scan_poll.h"
#include "core/numeric/expansion.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

// A direction within this distance of a coordinate axis, relative to its length, is replaced by the
// axis. Not tuned; any value is correct.
constexpr double kAxisTilt = 0x1p-30;

// Returns true if the rotation permutes the axes, up to signs, and its matrix is exact. With one,
// two, or four components of equal magnitude, entries are 0, 1, and -1; with three, some are 1/3.
bool PermutesAxes(const PlacedHull& placed) {
  if (placed.product() != nullptr) return false;
  const double* const R = placed.R_WH().data();
  if (!std::all_of(R, R + 9, [](double x) { return x == 0 || std::abs(x) == 1; })) return false;
  double largest = 0;
  for (const double c : placed.X_WH().q) largest = std::max(largest, std::abs(c));
  const auto& q = placed.X_WH().q;
  return std::all_of(q.begin(), q.end(),
                     [&](double c) { return c == 0 || std::abs(c) == largest; });
}

// Returns true if all differences of vertices are doubles, computed without rounding, and so are
// their multiples by 1 and -1: vertices and the offset are multiples of a unit, and at most the
// size of the pair, less than 2^51 units.
bool IsOnLattice(const FloatPair& pair) {
  if (!PermutesAxes(pair.a()) || !PermutesAxes(pair.b())) return false;
  const int exponent = std::ilogb(pair.size()) - 50;
  if (std::min(pair.a().query_hull().exponent(), pair.b().query_hull().exponent()) < exponent) {
    return false;
  }
  // Doubles near this are multiples of the unit.
  const double rounder = std::ldexp(1.5, exponent + 52);
  const Vector offset = pair.offset();
  for (int i = 0; i < 3; ++i) {
    if (TwoSum(pair.b().X_WH().t[i], -pair.a().X_WH().t[i]).error != 0) return false;
    if ((offset[i] + rounder) - rounder != offset[i]) return false;
  }
  return true;
}

// Returns true if the triangle contains the origin. False for collinear corners. Requires: the
// origin in the triangle's plane.
bool ContainsOrigin(const Vector& p, const Vector& q, const Vector& r, CoordinatePlane plane) {
  const Vector origin = Vector::Zero();
  const auto [min, max] = std::minmax({Orient2d(p, q, origin, plane), Orient2d(q, r, origin, plane),
                                       Orient2d(r, p, origin, plane)});
  return (min >= 0 && max > 0) || (max <= 0 && min < 0);
}

// Returns true if vertex i is farther than all others.
bool IsAlone(std::span<const uint32_t> candidates, uint32_t i) {
  return candidates.size() == 1 && candidates[0] == i;
}

// Returns true if the plane across a coordinate axis n supports both hulls. Longer scans are left
// to a search that polls.
bool TouchesAcross(const FloatPair& pair, const Vector& n) {
  CandidateBuffer buffer;
  double max_a = -kInfinity;
  const std::span<const uint32_t> a = pair.CandidatesA(n, 0, buffer);
  if (a.size() > ScanPoll::kItemsPerPoll) return false;
  for (const uint32_t i : a) max_a = std::max(max_a, n.dot(Vector(pair.PositionA(i))));
  double min_b = kInfinity;
  const std::span<const uint32_t> b = pair.CandidatesB(n, 0, buffer);
  if (b.size() > ScanPoll::kItemsPerPoll) return false;
  for (const uint32_t i : b) min_b = std::min(min_b, n.dot(Vector(pair.PositionB(i))));
  return max_a == min_b;
}

// Finds a contact between a vertex of A and a vertex of B along a direction that rounding may have
// tilted.
std::optional<LatticeContact> AtVertex(const FloatPair& pair, const VertexPair& at, Vector n) {
  if (!IsZero(pair.Difference(at))) return std::nullopt;
  Eigen::Index axis = 0;
  const double largest = n.cwiseAbs().maxCoeff(&axis);
  if (!IsFilterDirection(largest)) return std::nullopt;
  Vector across = Vector::Zero();
  across[axis] = n[axis] > 0 ? 1 : -1;
  CandidateBuffer buffer;
  if (LargestComponent(Vector(n - largest * across)) <= kAxisTilt * largest) {
    n = across;
    if (!TouchesAcross(pair, n)) return std::nullopt;
  } else if (!IsAlone(pair.CandidatesA(n, 0, buffer), at.a) ||
             !IsAlone(pair.CandidatesB(n, 0, buffer), at.b)) {
    return std::nullopt;
  }
  return LatticeContact{n, {at, at, at}};
}

}  // namespace

std::optional<LatticeContact> FindLatticeContact(const FloatPair& pair,
                                                 const FloatSearchResult& end) {
  if (!pair.usable() || !IsOnLattice(pair)) return std::nullopt;
  if (end.pair_count == 1) return AtVertex(pair, end.pairs[0], end.axis);
  std::array<Vector, 4> w;
  for (uint32_t i = 0; i < end.pair_count; ++i) w[i] = pair.Difference(end.pairs[i]);
  for (int axis = 0; axis < 3; ++axis) {
    // Corners in the plane, and the height of a corner that is not.
    std::array<uint32_t, 4> in_plane;
    uint32_t count = 0;
    double height = -end.axis[axis];
    for (uint32_t i = 0; i < end.pair_count; ++i) {
      if (w[i][axis] == 0) {
        in_plane[count++] = i;
      } else {
        height = w[i][axis];
      }
    }
    if (count < 3) continue;
    Vector n = Vector::Zero();
    n[axis] = height < 0 ? 1 : -1;
    if (!TouchesAcross(pair, n)) continue;
    const CoordinatePlane plane = {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
    for (uint32_t skipped = count == 3 ? 3 : 0; skipped < 4; ++skipped) {
      const uint32_t p = in_plane[skipped == 0 ? 1 : 0];
      const uint32_t q = in_plane[skipped <= 1 ? 2 : 1];
      const uint32_t r = in_plane[skipped <= 2 ? 3 : 2];
      if (ContainsOrigin(w[p], w[q], w[r], plane)) {
        return LatticeContact{n, {end.pairs[p], end.pairs[q], end.pairs[r]}};
      }
    }
  }
  return std::nullopt;
}

}  // namespace hulld
