#include "core/query/floating/float_search.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/simd_path.h"
#include "core/query/floating/small_pair.h"
#include "core/query/terms/minkowski_vertex.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {
namespace {

// Direction limit. More directions occur only near contact, where exact signs are needed anyway.
// Observed: random pairs of 10000 vertices, 1e-6 apart, need 18 on average.
constexpr uint64_t kMaxDirections = 64;

using Corner = MinkowskiVertex<PlainVector>;

// The corners of the part of A - B that is nearest to the origin so far: a vertex, an edge, a
// triangle or a tetrahedron. The newest comes last. Corners are not moved after they are written;
// only their order changes.
class Simplex {
 public:
  uint32_t count() const { return count_; }
  const Corner& corner(uint32_t i) const { return slots_[order_[i]]; }

  bool Contains(VertexPair pair) const {
    for (uint32_t i = 0; i < count_; ++i) {
      if (corner(i).pair == pair) return true;
    }
    return false;
  }

  // Drops all but the newest.
  void KeepNewest() { Keep(order_[count_ - 1]); }

  // Requires: count() < 4.
  void Add(const PlainVector& w, VertexPair pair) {
    HULLD_DCHECK(count_ < 4);
    uint32_t taken = 0;
    for (uint32_t i = 0; i < count_; ++i) taken |= 1u << order_[i];
    const auto slot = static_cast<uint8_t>(std::countr_one(taken));
    slots_[slot].w.x = w.x;
    slots_[slot].w.y = w.y;
    slots_[slot].w.z = w.z;
    slots_[slot].pair.a = pair.a;
    slots_[slot].pair.b = pair.b;
    order_[count_++] = slot;
  }

  // Reduces to the corners of the face nearest to the origin, up to rounding, and sets n to a
  // direction from that face toward the origin. Returns false if the origin is in the tetrahedron.
  bool Reduce(PlainVector& n) {
    switch (count_) {
      case 1:
        n = -corner(0).w;
        return true;
      case 2:
        ReduceEdge(n);
        return true;
      case 3:
        ReduceTriangle(n);
        return true;
      case 4:
        return ReduceTetrahedron(n);
      default:
        HULLD_UNREACHABLE();
    }
  }

  // Reduces a tetrahedron that contains the origin to the nearest of its faces, up to rounding.
  // Returns the outward normal of that face.
  PlainVector ReduceToNearestFace() {
    double nearest = INFINITY;
    uint32_t off_face = 3;
    PlainVector outwards(1, 0, 0);
    for (uint32_t i = 0; i < 4; ++i) {
      const PlainVector& p = corner((i + 1) % 4).w;
      PlainVector n = Cross(corner((i + 2) % 4).w - p, corner((i + 3) % 4).w - p);
      if (Dot(n, corner(i).w - p) > 0) n = -n;
      const double distance = Dot(n, p) / Norm(n);
      if (!(distance < nearest)) continue;
      nearest = distance;
      off_face = i;
      outwards = n;
    }
    std::swap(order_[off_face], order_[3]);
    count_ = 3;
    return outwards;
  }

  // Returns a point of the simplex near to the origin; after Reduce, the nearest up to rounding.
  // For any rounding, weights are in [0, 1] and the point is in the simplex, up to the rounding of
  // the weighted sum.
  PlainVector NearPoint() const {
    const PlainVector& p = corner(count_ - 1).w;
    if (count_ == 1) return p;
    const PlainVector& q = corner(count_ - 2).w;
    if (count_ == 2) return p + Weight(-Dot(q - p, p), SquaredNorm(q - p)) * (q - p);
    const PlainVector& r = corner(count_ - 3).w;
    const PlainVector normal = Cross(q - p, r - p);
    // The origin's coordinates in the triangle, by areas; for a tetrahedron, in its last face.
    const double area = SquaredNorm(normal);
    const double along_q = Weight(-Dot(Cross(r - p, normal), p), area);
    const double along_r = Weight(-Dot(Cross(normal, q - p), p), area);
    const double sum = std::max(1.0, along_q + along_r);
    return p + (along_q / sum) * (q - p) + (along_r / sum) * (r - p);
  }

 private:
  static double Weight(double part, double whole) {
    return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0;
  }
  // Keeps the corners at these places in slots_, the newest last.
  void Keep(uint8_t p) {
    order_[0] = p;
    count_ = 1;
  }
  void Keep(uint8_t q, uint8_t p) {
    order_[0] = q;
    order_[1] = p;
    count_ = 2;
  }
  void Keep(uint8_t r, uint8_t q, uint8_t p) {
    order_[0] = r;
    order_[1] = q;
    order_[2] = p;
    count_ = 3;
  }

  // Returns the direction from the edge's line toward the origin.
  static PlainVector AcrossEdge(const PlainVector& p, const PlainVector& e) {
    return (Dot(e, p) / SquaredNorm(e)) * e - p;
  }

  void ReduceEdge(PlainVector& n) {
    const PlainVector p = corner(1).w;
    const PlainVector e = corner(0).w - p;
    if (Dot(e, p) < 0) {
      n = AcrossEdge(p, e);
    } else {
      n = -p;
      Keep(order_[1]);
    }
  }

  // Finds the nearest part of the triangle p, p + e, p + f, with p its newest corner. The edge
  // opposite to p and the ends of that edge are not nearest, because p was farther toward the
  // origin; so three of the seven parts that FindNearestOnTriangle distinguishes need no test.
  // `normal`: e x f.
  enum class Part { kCorner, kEdgeToQ, kEdgeToR, kInside };
  static Part NearestPart(const PlainVector& p, const PlainVector& e, const PlainVector& f,
                          const PlainVector& normal, PlainVector& n) {
    const double along_e = -Dot(e, p);
    const double along_f = -Dot(f, p);
    if (along_e <= 0 && along_f <= 0) {
      n = -p;
      return Part::kCorner;
    }
    if (along_e > 0 && Dot(Cross(e, normal), p) < 0) {
      n = AcrossEdge(p, e);
      return Part::kEdgeToQ;
    }
    if (along_f > 0 && Dot(Cross(normal, f), p) < 0) {
      n = AcrossEdge(p, f);
      return Part::kEdgeToR;
    }
    const double turn = Dot(normal, p) > 0 ? -1 : 1;
    n = turn * normal;
    return Part::kInside;
  }

  void KeepPart(Part part, uint8_t p, uint8_t q, uint8_t r) {
    switch (part) {
      case Part::kCorner:
        return Keep(p);
      case Part::kEdgeToQ:
        return Keep(q, p);
      case Part::kEdgeToR:
        return Keep(r, p);
      case Part::kInside:
        return Keep(r, q, p);
    }
    HULLD_UNREACHABLE();
  }

  void ReduceTriangle(PlainVector& n) {
    const PlainVector p = corner(2).w;
    const PlainVector e = corner(1).w - p;
    const PlainVector f = corner(0).w - p;
    KeepPart(NearestPart(p, e, f, Cross(e, f), n), order_[2], order_[1], order_[0]);
  }

  // Returns the squared distance from the origin along n, which leads there from the part that
  // contains p.
  static double SquaredDistance(const PlainVector& n, const PlainVector& p) {
    const double along = Dot(n, p);
    return along * along / SquaredNorm(n);
  }

  bool ReduceTetrahedron(PlainVector& n) {
    const PlainVector p = corner(3).w;
    const uint8_t others[4] = {order_[2], order_[1], order_[0], order_[2]};
    const PlainVector e = corner(2).w - p;
    const PlainVector f = corner(1).w - p;
    const PlainVector g = corner(0).w - p;
    const PlainVector normal_ef = Cross(e, f);
    const PlainVector normal_fg = Cross(f, g);
    const PlainVector normal_ge = Cross(g, e);
    const double turn = Dot(normal_ef, g) > 0 ? -1 : 1;
    // The origin is beyond a face that has p as a corner.
    const bool beyond_ef = turn * Dot(normal_ef, p) < 0;
    const bool beyond_fg = turn * Dot(normal_fg, p) < 0;
    const bool beyond_ge = turn * Dot(normal_ge, p) < 0;
    double nearest = INFINITY;
    int face = -1;
    Part part = Part::kInside;
    const auto consider = [&](int i, const PlainVector& to_q, const PlainVector& to_r,
                              const PlainVector& normal) {
      PlainVector toward;
      const Part candidate = NearestPart(p, to_q, to_r, normal, toward);
      const double distance = SquaredDistance(toward, p);
      if (!(distance < nearest)) return;
      nearest = distance;
      face = i;
      part = candidate;
      n = toward;
    };
    if (beyond_ef) consider(0, e, f, normal_ef);
    if (beyond_fg) consider(1, f, g, normal_fg);
    if (beyond_ge) consider(2, g, e, normal_ge);
    if (face < 0) return false;
    KeepPart(part, order_[3], others[face], others[face + 1]);
    return true;
  }

  std::array<Corner, 4> slots_;
  std::array<uint8_t, 4> order_ = {};
  uint32_t count_ = 0;
};

// Returns true if the origin is certainly strictly inside a tetrahedron of computed Minkowski
// vertices.
template <typename Pair>
bool HoldsOrigin(const Pair& pair, const PlainVector& p, const PlainVector& q, const PlainVector& r,
                 const PlainVector& s) {
  const double largest = std::max(std::max(LargestComponent(p), LargestComponent(q)),
                                  std::max(LargestComponent(r), LargestComponent(s)));
  const double position_error = kMinkowskiErrorFactor * pair.size();
  const double bound = kTetrahedronErrorFactor * largest * largest * position_error;
  // The origin's barycentric coordinates, determinants of three corners each, up to a common factor
  // with the sign of the first.
  const PlainVector p_q = Cross(p, q);
  const PlainVector r_s = Cross(r, s);
  const double first = Dot(p_q, r);
  const double turn = first > 0 ? 1 : -1;
  return turn * first > bound && -turn * Dot(p_q, s) > bound && turn * Dot(r_s, p) > bound &&
         -turn * Dot(r_s, q) > bound;
}

// A search for a FloatPair or a SmallPair.
template <typename Pair>
class FloatSearch {
 public:
  FloatSearch(const Pair& pair, double tolerance) : pair_(pair), tolerance_(tolerance) {}

  FloatSearchResult Run(PlainVector n) {
    if (IsZero(n)) n = {1, 0, 0};
    while (result_.directions_tried < kMaxDirections && Explore(n)) {
    }
    if (result_.verdict != FloatVerdict::kSeparated) result_.axis = along_;
    result_.pair_count = simplex_.count();
    for (uint32_t i = 0; i < simplex_.count(); ++i) result_.pairs[i] = simplex_.corner(i).pair;
    return result_;
  }

 private:
  // Explores along n and sets n to the next direction. Returns false if the search is over.
  bool Explore(PlainVector& n) {
    double largest = LargestComponent(n);
    if (!IsFilterDirection(largest)) {
      if (!(largest > 0)) return false;
      n = 1 / UnitOf(largest) * n;
      largest = LargestComponent(n);
    }
    ++result_.directions_tried;
    const FloatPair::Support farthest = pair_.Farthest(n);
    const double error = kSupportErrorFactor * largest * pair_.size();
    if (farthest.value < -error) return EndSeparated(n);
    const PlainVector along = n;
    along_ = along;
    // Without progress, no vertex is farther toward the origin.
    const bool progress = !simplex_.Contains(farthest.pair);
    bool outside = true;
    bool at_corner = false;
    if (progress) {
      const PlainVector w = pair_.Difference(farthest.pair);
      simplex_.Add(w, farthest.pair);
      // The direction of a vertex this close to the origin is dominated by rounding, and no certain
      // conclusion can follow from it.
      at_corner = LargestComponent(w) <= kMinkowskiErrorFactor * pair_.size();
      if (at_corner) {
        simplex_.KeepNewest();
      } else {
        outside = simplex_.Reduce(n);
      }
    }
    if (!outside) {
      if (HoldsOrigin(pair_, simplex_.corner(0).w, simplex_.corner(1).w, simplex_.corner(2).w,
                      simplex_.corner(3).w)) {
        result_.verdict = FloatVerdict::kOverlapping;
        return false;
      }
      if (tolerance_ == 0) return false;
      // Near the boundary of A - B: continues through the nearest face, to find the reach there.
      n = simplex_.ReduceToNearestFace();
    }
    if (tolerance_ > 0 && IsWithinTolerance(along, farthest, error)) {
      result_.verdict = FloatVerdict::kWithinTolerance;
      return false;
    }
    return progress && !at_corner;
  }

  bool EndSeparated(const PlainVector& n) {
    result_.verdict = FloatVerdict::kSeparated;
    result_.axis = n;
    return false;
  }

  // Returns true if |separation| <= tolerance is certain: A - B has a point within the tolerance of
  // the origin and, along some direction, reaches at most the tolerance beyond it. `farthest` is
  // the vertex farthest along n. Tests the reach first, because a reach that is too long is cheap
  // to detect.
  bool IsWithinTolerance(const PlainVector& n, const FloatPair::Support& farthest, double error) {
    if (!reach_is_short_) {
      const double allowed = tolerance_ * Norm(n);
      if (!(farthest.value < allowed)) return false;
      if (!((farthest.value + error) * kSphereSquareRoundUp <= allowed)) return false;
      reach_is_short_ = true;
    }
    const double distance = Norm(simplex_.NearPoint()) + kNearPointErrorFactor * pair_.size();
    return distance * kSphereSquareRoundUp <= tolerance_;
  }

  const Pair& pair_;
  const double tolerance_;
  Simplex simplex_;
  // The last direction tried.
  PlainVector along_;
  // With a tolerance: true if A - B is known to reach no farther than the tolerance beyond the
  // origin along some direction.
  bool reach_is_short_ = false;
  FloatSearchResult result_;
};

template <uint32_t kMaxVertices>
FloatSearchResult SearchSmallPortably(const FloatPair& pair, double tolerance,
                                      const PlainVector& first) {
  const SmallPair<kMaxVertices> small(pair);
  return FloatSearch(small, tolerance).Run(first);
}

#ifdef HULLD_HAS_AVX2_PATH
// The entire call tree is compiled for AVX2, so that lanes stay in registers.
template <uint32_t kMaxVertices>
__attribute__((target("avx2"), flatten)) FloatSearchResult SearchSmallAvx2(
    const FloatPair& pair, double tolerance, const PlainVector& first) {
  const SmallPair<kMaxVertices> small(pair);
  return FloatSearch(small, tolerance).Run(first);
}
#else
template <uint32_t kMaxVertices>
FloatSearchResult SearchSmallAvx2(const FloatPair& pair, double tolerance,
                                  const PlainVector& first) {
  return SearchSmallPortably<kMaxVertices>(pair, tolerance, first);
}
#endif

template <uint32_t kMaxVertices>
FloatSearchResult SearchSmall(const FloatPair& pair, double tolerance, const PlainVector& first) {
  return CurrentSimdPath() == SimdPath::kAvx2
             ? SearchSmallAvx2<kMaxVertices>(pair, tolerance, first)
             : SearchSmallPortably<kMaxVertices>(pair, tolerance, first);
}

}  // namespace

FloatSearchResult SearchInFloatingPoint(const FloatPair& pair, double tolerance,
                                        const PlainVector& first) {
  HULLD_DCHECK(pair.usable());
  if (SmallPair<8>::Fits(pair)) return SearchSmall<8>(pair, tolerance, first);
  if (SmallPair<16>::Fits(pair)) return SearchSmall<16>(pair, tolerance, first);
  return FloatSearch(pair, tolerance).Run(first);
}

FloatSearchResult TryCached(const FloatPair& pair, const PairCache& cache) {
  HULLD_DCHECK(pair.usable());
  FloatSearchResult result;
  if (cache.axis.has_value()) {
    const PlainVector n = *cache.axis;
    ++result.directions_tried;
    const double error = pair.SupportError(n);
    const double value = pair.Farthest(n).value;
    if (value < -error) {
      result.verdict = FloatVerdict::kSeparated;
      result.axis = n;
    } else if (cache.pair_count > 0 && value <= error) {
      result.axis = n;
      result.pair_count = cache.pair_count;
      std::copy(cache.pairs, cache.pairs + cache.pair_count, result.pairs.begin());
    }
  } else if (cache.pair_count == 4) {
    for ([[maybe_unused]] const VertexPair& known : cache.pairs) {
      HULLD_DCHECK(known.a < pair.a().query_hull().point_count() &&
                   known.b < pair.b().query_hull().point_count());
    }
    const auto difference = [&](int i) { return pair.Difference(cache.pairs[i]); };
    if (HoldsOrigin(pair, difference(0), difference(1), difference(2), difference(3))) {
      result.verdict = FloatVerdict::kOverlapping;
      result.pair_count = 4;
      std::copy(cache.pairs, cache.pairs + 4, result.pairs.begin());
    }
  }
  return result;
}

}  // namespace hulld
