#include "core/query/floating/facet_entry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/numeric/double_double.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/simd_path.h"
#include "core/query/placed/lanes.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {
namespace {

using Facet = std::array<VertexPair, 3>;

// A vector in double-double arithmetic, in three lanes: DoubleDouble's operations on each
// component, with the same error bounds. Everything is inlined, so that it is compiled for the
// instruction set of FindCrossing.
struct LongVector {
  Lanes high;
  Lanes low;

  DoubleDouble operator[](int i) const { return {high[i], low[i]}; }
};

[[gnu::always_inline]] inline LongVector LaneSum(const Lanes& a, const Lanes& b) {
  const Lanes sum = a + b;
  const Lanes b_virtual = sum - a;
  const Lanes a_virtual = sum - b_virtual;
  return {sum, (a - a_virtual) + (b - b_virtual)};
}
[[gnu::always_inline]] inline LongVector FastLaneSum(const Lanes& a, const Lanes& b) {
  const Lanes sum = a + b;
  return {sum, b - (sum - a)};
}
[[gnu::always_inline]] inline LongVector LaneProduct(const Lanes& a, const Lanes& b) {
  constexpr double kSplitter = 0x1p27 + 1;
  const Lanes product = a * b;
  const Lanes a_big = kSplitter * a;
  const Lanes a_high = a_big - (a_big - a);
  const Lanes a_low = a - a_high;
  const Lanes b_big = kSplitter * b;
  const Lanes b_high = b_big - (b_big - b);
  const Lanes b_low = b - b_high;
  return {product,
          a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}
[[gnu::always_inline]] inline LongVector operator+(const LongVector& x, const LongVector& y) {
  const LongVector s = LaneSum(x.high, y.high);
  const LongVector t = LaneSum(x.low, y.low);
  const LongVector v = FastLaneSum(s.high, s.low + t.high);
  return FastLaneSum(v.high, t.low + v.low);
}
[[gnu::always_inline]] inline LongVector operator-(const LongVector& x, const LongVector& y) {
  return x + LongVector{-y.high, -y.low};
}
[[gnu::always_inline]] inline LongVector operator*(const LongVector& x, const LongVector& y) {
  const LongVector c = LaneProduct(x.high, y.high);
  return FastLaneSum(c.high, c.low + (x.high * y.low + x.low * y.high));
}
[[gnu::always_inline]] inline LongVector operator*(const LongVector& x, const DoubleDouble& y) {
  const double h = y.high;
  const double l = y.low;
  return x * LongVector{Lanes{h, h, h, h}, Lanes{l, l, l, l}};
}

template <int i, int j, int k>
[[gnu::always_inline]] inline LongVector Permuted(const LongVector& v) {
  return {__builtin_shufflevector(v.high, v.high, i, j, k, 3),
          __builtin_shufflevector(v.low, v.low, i, j, k, 3)};
}

[[gnu::always_inline]] inline DoubleDouble Dot(const LongVector& p, const LongVector& q) {
  const LongVector products = p * q;
  return (products[0] + products[1]) + products[2];
}
[[gnu::always_inline]] inline LongVector Cross(const LongVector& p, const LongVector& q) {
  return Permuted<1, 2, 0>(p) * Permuted<2, 0, 1>(q) - Permuted<2, 0, 1>(p) * Permuted<1, 2, 0>(q);
}
[[gnu::always_inline]] inline double LargestComponent(const LongVector& v) {
  return std::max({std::abs(v.high[0]), std::abs(v.high[1]), std::abs(v.high[2])});
}
// Returns the exact difference.
[[gnu::always_inline]] inline LongVector Difference(const Vector& p, const Vector& q) {
  return LaneSum(Lanes{p.x(), p.y(), p.z(), 0}, Lanes{-q.x(), -q.y(), -q.z(), 0});
}

// N R for the rotation R and the squared norm N of a quaternion that was scaled so that its largest
// component is in [1/2, 1).
struct LongRotation {
  [[gnu::always_inline]] explicit LongRotation(const std::array<double, 4>& q) {
    double largest = 0;
    for (const double component : q) largest = std::max(largest, std::abs(component));
    const double scale = std::ldexp(1.0, -(std::ilogb(largest) + 1));
    const double w = scale * q[0], x = scale * q[1], y = scale * q[2], z = scale * q[3];
    const Lanes axis = {x, y, z, 0};
    const Lanes turned = {y, z, x, 0};
    const LongVector squares = LaneProduct(axis, axis);                           // xx yy zz
    const LongVector mixed = LaneProduct(axis, turned);                           // xy yz zx
    const LongVector scaled = LaneProduct(Lanes{z, x, y, 0}, Lanes{w, w, w, 0});  // wz wx wy
    const DoubleDouble ww = ExactProduct(w, w);
    const LongVector ww_plus = squares + Of(ww, ww, ww);
    const LongVector rest = Permuted<1, 2, 0>(squares) + Permuted<2, 0, 1>(squares);
    const LongVector diagonal = ww_plus - rest;
    const LongVector below = Doubled(mixed + scaled);  // rows and columns (1, 0), (2, 1), (0, 2)
    const LongVector above = Doubled(mixed - scaled);  // (0, 1), (1, 2), (2, 0)
    norm = ww_plus[0] + rest[0];
    columns[0] = Of(diagonal[0], below[0], above[2]);
    columns[1] = Of(above[0], diagonal[1], below[1]);
    columns[2] = Of(below[2], above[1], diagonal[2]);
  }

  [[gnu::always_inline]] LongVector operator*(const LongVector& v) const {
    return (columns[0] * v[0] + columns[1] * v[1]) + columns[2] * v[2];
  }
  // Returns n . R v.
  [[gnu::always_inline]] DoubleDouble Along(const LongVector& n, const Vector& v) const {
    if (v.isZero(0)) return {};
    return Dot(n, *this * LongVector{Lanes{v.x(), v.y(), v.z(), 0}, Lanes{0, 0, 0, 0}}) / norm;
  }

  LongVector columns[3];
  DoubleDouble norm;

 private:
  [[gnu::always_inline]] static LongVector Doubled(const LongVector& v) {
    return {2 * v.high, 2 * v.low};
  }
  [[gnu::always_inline]] static LongVector Of(const DoubleDouble& x, const DoubleDouble& y,
                                              const DoubleDouble& z) {
    return {Lanes{x.high, y.high, z.high, 0}, Lanes{x.low, y.low, z.low, 0}};
  }
};

// True if the facet has three different pairs with only four vertices in total. All of its vertices
// of A then have the same value along its normal, and so do its vertices of B. Moves a pair that
// shares a vertex with both other pairs to the front.
bool IsOfFourVertices(Facet& facet) {
  const auto shares = [](VertexPair p, VertexPair q) { return (p.a == q.a) != (p.b == q.b); };
  for (int i = 0; i < 3; ++i) {
    if (shares(facet[0], facet[1]) && shares(facet[0], facet[2])) return facet[1] != facet[2];
    std::rotate(facet.begin(), facet.begin() + 1, facet.end());
  }
  return false;
}

// True if the line of the path certainly crosses the inside of the triangle.
bool CrossesInside(const FloatPair& start, const RelativePath& path,
                   const std::array<PlainVector, 3>& corners) {
  const double largest = std::max(
      {LargestComponent(corners[0]), LargestComponent(corners[1]), LargestComponent(corners[2])});
  const double of_path = path.displacement.cwiseAbs().maxCoeff();
  // Scaled below `largest`, at most 4 S, the displacement errs by at most 2 u * 32 * 4 S = 2 d, as
  // kDifferencesErrorFactor allows.
  constexpr double kMaxCancelled = 32;
  if (!(largest > 0) || path.length > kMaxCancelled * of_path) return false;
  const double scale = UnitOf(largest) / (2 * UnitOf(of_path));
  const PlainVector d = scale * PlainVector(path.displacement);
  const double position_error = kMinkowskiErrorFactor * start.size();
  const double bound = kDifferencesErrorFactor * largest * largest * position_error;
  const auto turn = [&](int i, int j) { return Dot(d, Cross(corners[i], corners[j])); };
  const auto [min, max] = std::minmax({turn(0, 1), turn(1, 2), turn(2, 0)});
  return min > bound || max < -bound;
}

// True if all vertices that may be farthest belong to the facet.
template <typename VertexOf>
bool AreOfFacet(std::span<const uint32_t> candidates, const Facet& facet, VertexOf vertex_of) {
  return std::ranges::all_of(candidates, [&](uint32_t candidate) {
    return std::ranges::any_of(facet,
                               [&](VertexPair pair) { return vertex_of(pair) == candidate; });
  });
}

// True if the facet's plane certainly supports C on the side of its normal, (q - p) x (r - p) times
// `sign`. Requires: IsOfFourVertices(facet).
bool Supports(const FloatPair& start, const Facet& facet, const std::array<PlainVector, 3>& corners,
              double sign) {
  const PlainVector e = corners[1] - corners[0];
  const PlainVector f = corners[2] - corners[0];
  const Vector n = sign * Cross(e, f);
  const double position_error = kMinkowskiErrorFactor * start.size();
  const double error = kNormalErrorFactor * position_error *
                       (LargestComponent(e) + LargestComponent(f) + 3 * position_error);
  CandidateBuffer buffer;
  return AreOfFacet(start.CandidatesA(n, error, buffer), facet, [](VertexPair p) { return p.a; }) &&
         AreOfFacet(start.CandidatesB(n, error, buffer), facet, [](VertexPair p) { return p.b; });
}

// The time at which the path crosses the plane of a facet, (n . p) / (n . d), with its error; and
// the sign of n . d.
struct CrossingTime {
  DoubleDouble value;
  double error;
  double sign;
};

// Returns nothing if the error may exceed the bound. Requires: IsOfFourVertices(facet), and poses
// that are not products.
[[gnu::always_inline]] inline std::optional<CrossingTime> FindCrossingIn(const FloatPair& start,
                                                                         const RelativePath& path,
                                                                         const Motion& X_WA,
                                                                         const Motion& X_WB,
                                                                         const Facet& facet) {
  const LongRotation R_A(X_WA.start.q);
  const LongRotation R_B(X_WB.start.q);
  const VertexPair p = facet[0];
  const QueryHull& a = start.a().query_hull();
  const QueryHull& b = start.b().query_hull();
  // Edges times the norm of the rotation, and the largest component before that.
  double sizes = 1;
  const auto edge = [&](VertexPair to) {
    const bool is_of_a = to.b == p.b;
    const LongVector own =
        is_of_a ? Difference(a.point(to.a), a.point(p.a)) : Difference(b.point(p.b), b.point(to.b));
    const LongRotation& R = is_of_a ? R_A : R_B;
    const double size = LargestComponent(own);
    sizes *= size >= kEntryMinEdge ? R.norm.high * size : kInfinity;
    return R * own;
  };
  const LongVector n = Cross(edge(facet[1]), edge(facet[2]));
  const LongVector d = Difference(X_WB.end.t, X_WB.start.t) - Difference(X_WA.end.t, X_WA.start.t);
  const DoubleDouble speed = Dot(n, d);
  const double slope = std::abs(speed.high);
  if (!(slope > kEntryTimeErrorFactor * sizes * path.length)) return std::nullopt;
  const DoubleDouble reach = (R_A.Along(n, a.point(p.a)) - R_B.Along(n, b.point(p.b))) -
                             Dot(n, Difference(X_WB.start.t, X_WA.start.t));
  const DoubleDouble time = reach / speed;
  const double error =
      kEntryTimeErrorFactor * sizes * (start.size() + std::abs(time.high) * path.length) / slope;
  return CrossingTime{time, error, speed.high > 0 ? 1.0 : -1.0};
}

std::optional<CrossingTime> FindCrossingPortably(const FloatPair& start, const RelativePath& path,
                                                 const Motion& X_WA, const Motion& X_WB,
                                                 const Facet& facet) {
  return FindCrossingIn(start, path, X_WA, X_WB, facet);
}

#ifdef HULLD_HAS_AVX2_PATH
__attribute__((target("avx2"), flatten)) std::optional<CrossingTime> FindCrossingAvx2(
    const FloatPair& start, const RelativePath& path, const Motion& X_WA, const Motion& X_WB,
    const Facet& facet) {
  return FindCrossingIn(start, path, X_WA, X_WB, facet);
}
#else
constexpr auto FindCrossingAvx2 = FindCrossingPortably;
#endif

// Returns the doubles around the time, if it is certainly inside [0, 1] and not a double.
std::optional<BetweenTimes> Around(const CrossingTime& time) {
  const double nearest = time.value.high;
  if (!(nearest > 0 && nearest <= 1)) return std::nullopt;
  const double next = std::nextafter(nearest, 2.0);
  const double last = std::nextafter(nearest, 0.0);
  const double rest = time.value.low;
  // The differences of adjacent doubles are exact.
  if (rest > time.error && rest + time.error < next - nearest && next <= 1) {
    return BetweenTimes{nearest, next};
  }
  if (-rest > time.error && -rest + time.error < nearest - last) {
    return BetweenTimes{last, nearest};
  }
  return std::nullopt;
}

}  // namespace

std::optional<BetweenTimes> FindEntry(const FloatPair& start, const RelativePath& path,
                                      const Motion& X_WA, const Motion& X_WB,
                                      const std::array<VertexPair, 3>& facet) {
  const bool is_solid =
      start.a().query_hull().dimension() == 3 || start.b().query_hull().dimension() == 3;
  const bool is_product = start.a().product() != nullptr || start.b().product() != nullptr;
  const bool is_in_range = start.size() >= kEntryMinSize && path.size <= kEntryMaxSize;
  Facet ordered = facet;
  if (!is_solid || is_product || !is_in_range || !IsOfFourVertices(ordered)) return std::nullopt;
  const std::array<PlainVector, 3> corners = {
      start.Difference(ordered[0]), start.Difference(ordered[1]), start.Difference(ordered[2])};
  if (!CrossesInside(start, path, corners)) return std::nullopt;
  const auto find_crossing = UsesAvx2() ? FindCrossingAvx2 : FindCrossingPortably;
  const std::optional<CrossingTime> time = find_crossing(start, path, X_WA, X_WB, ordered);
  // The path enters if it runs against the normal.
  if (!time || !Supports(start, ordered, corners, -time->sign)) return std::nullopt;
  return Around(*time);
}

}  // namespace hulld
