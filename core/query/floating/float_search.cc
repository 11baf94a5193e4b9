#include "core/query/floating/float_search.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/simd_path.h"
#include "core/query/floating/nearest_part.h"
#include "core/query/floating/simplex.h"
#include "core/query/floating/small_pair.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {
namespace {

// Direction limit. More directions occur only near contact, where exact signs are needed anyway.
// Observed: random pairs of 10000 vertices, 1e-6 apart, need 18 on average.
constexpr uint64_t kMaxDirections = 64;

// Returns true if the origin is certainly strictly inside a tetrahedron of points of A - B, each
// computed within kMinkowskiErrorFactor.
template <typename Pair>
bool ContainsOrigin(const Pair& pair, const PlainVector& p, const PlainVector& q,
                    const PlainVector& r, const PlainVector& s) {
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

// Finds the vertex w of A - B farthest along n.
template <typename SmallPair>
[[gnu::always_inline]] inline void FindFarthest(const SmallPair& pair, const LaneVector& n,
                                                FloatPair::Support& farthest, LaneVector& w) {
  farthest = pair.Farthest(n, w);
}
[[gnu::always_inline]] inline void FindFarthest(const FloatPair& pair, const LaneVector& n,
                                                FloatPair::Support& farthest, LaneVector& w) {
  farthest = pair.Farthest(n.plain());
  w = LaneVector(pair.Difference(farthest.pair));
}

// Reduces a flat tetrahedron. Returns the direction toward the origin. Not inlined, to keep the
// search short.
[[gnu::noinline]] PlainVector TowardFromNearestFace(Simplex& simplex) {
  simplex.ReduceToNearestFace();
  return NearestOnTriangle(simplex.corner(0), simplex.corner(1), simplex.corner(2)).toward;
}

// A search for a FloatPair or a SmallPair. `simplex`: empty. It is not a member, so that compilers
// keep the members in registers.
template <typename Pair>
class FloatSearch {
 public:
  FloatSearch(const Pair& pair, double tolerance, double max_error, Simplex& simplex)
      : pair_(pair), tolerance_(tolerance), max_error_(max_error), simplex_(simplex) {}

  void Run(const PlainVector& first, const PlainVector* inner, FloatSearchResult& result) {
    LaneVector n(IsZero(first) ? PlainVector(1, 0, 0) : first);
    if (inner != nullptr) simplex_.Set(LaneVector(*inner), kInner);
    while (tried_ < kMaxDirections && Explore(n)) {
    }
    result.verdict = verdict_;
    result.axis = verdict_ == FloatVerdict::kSeparated ? axis_ : along_;
    result.reach = reach_;
    result.directions_tried = tried_;
    // With an inner point, only hints for exact arithmetic are needed.
    if (inner != nullptr && verdict_ != FloatVerdict::kUndecided) return;
    for (uint32_t i = 0; i < simplex_.count(); ++i) {
      if (simplex_.pair(i) != kInner) result.pairs[result.pair_count++] = simplex_.pair(i);
    }
  }

 private:
  // Stands for the inner point among the corners; no vertices have these numbers.
  static constexpr VertexPair kInner = {UINT32_MAX - 1, UINT32_MAX - 1};

  // Explores along n and sets n to the next direction. Returns false if the search is over.
  bool Explore(LaneVector& n) {
    double largest = LargestComponent(n.plain());
    if (!IsFilterDirection(largest)) {
      if (!(largest > 0)) return false;
      n = LaneVector(1 / UnitOf(largest) * n.plain());
      largest = LargestComponent(n.plain());
    }
    ++tried_;
    FloatPair::Support farthest;
    LaneVector w;
    FindFarthest(pair_, n, farthest, w);
    const double error = kSupportErrorFactor * largest * pair_.size();
    along_ = n.plain();
    if (farthest.value < -error) {
      verdict_ = FloatVerdict::kSeparated;
      axis_ = along_;
      reach_ = farthest.value;
      if (max_error_ == kEndsAtSign) return false;
    }
    const bool is_first = simplex_.count() == 0;
    if (verdict_ == FloatVerdict::kSeparated && !is_first) {
      // The direction leads across the corners, so this is the width of the bounds times its
      // length.
      const double ahead = farthest.value - Dot(along_, simplex_.corner(simplex_.count() - 1));
      const double allowed = max_error_ > 0 ? 2 * max_error_ * Norm(along_) : 0;
      if (!(ahead > error + allowed)) return false;
    }
    // Without progress, no vertex is farther toward the origin.
    const bool progress = is_first || !simplex_.Contains(farthest.pair);
    bool outside = true;
    bool at_corner = false;
    if (progress) {
      // The direction of a vertex this close to the origin is dominated by rounding, and no certain
      // conclusion can follow from it.
      at_corner = LargestComponent(w.plain()) <= kMinkowskiErrorFactor * pair_.size();
      if (is_first || at_corner) {
        simplex_.Set(w, farthest.pair);
        n.x = -w.x;
        n.y = -w.y;
        n.z = -w.z;
      } else {
        outside = simplex_.Add(w, farthest.pair, n);
      }
    }
    if (verdict_ == FloatVerdict::kSeparated) {
      // If the hulls are separated, only a flat tetrahedron seems to contain the origin.
      if (!outside) n = LaneVector(TowardFromNearestFace(simplex_));
      return progress;
    }
    if (!outside) {
      if (ContainsOrigin(pair_, simplex_.corner(0), simplex_.corner(1), simplex_.corner(2),
                         simplex_.corner(3))) {
        verdict_ = FloatVerdict::kOverlapping;
        return false;
      }
      if (tolerance_ == 0) return false;
      // Near the boundary of A - B: continues through the nearest face, to find the reach there.
      n = LaneVector(simplex_.ReduceToNearestFace());
    }
    if (tolerance_ > 0 && IsWithinTolerance(along_, farthest, error)) {
      verdict_ = FloatVerdict::kWithinTolerance;
      return false;
    }
    return progress && !at_corner;
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
  const double max_error_;
  Simplex& simplex_;
  uint64_t tried_ = 0;
  // The last direction tried.
  PlainVector along_;
  // Separated: the last axis that showed it, and the reach along it.
  PlainVector axis_;
  double reach_ = INFINITY;
  // With a tolerance: true if A - B is known to reach no farther than the tolerance beyond the
  // origin along some direction.
  bool reach_is_short_ = false;
  FloatVerdict verdict_ = FloatVerdict::kUndecided;
};

// Pair: a FloatPair or a SmallPair.
template <typename Pair>
void SearchPortably(const FloatPair& pair, double tolerance, const PlainVector& first,
                    double max_error, const PlainVector* inner, FloatSearchResult& result) {
  const Pair own(pair);
  Simplex simplex;
  FloatSearch(own, tolerance, max_error, simplex).Run(first, inner, result);
}

#ifdef HULLD_HAS_AVX2_PATH
// The entire call tree is compiled for AVX2, so that lanes stay in registers.
template <typename Pair>
__attribute__((target("avx2"), flatten)) void SearchByAvx2(const FloatPair& pair, double tolerance,
                                                           const PlainVector& first,
                                                           double max_error,
                                                           const PlainVector* inner,
                                                           FloatSearchResult& result) {
  const Pair own(pair);
  Simplex simplex;
  FloatSearch(own, tolerance, max_error, simplex).Run(first, inner, result);
}

#ifdef HULLD_HAS_LANE_LOOKUP
using EightForAvx2 = SmallPair<8, LaneLookup>;
using EightForAvx512 = SmallPair<8, LanePermutation>;
#else
using EightForAvx2 = SmallPair<8>;
using EightForAvx512 = SmallPair<8>;
#endif

// AVX-512 has enough registers for all vertices. Observed: 11 % faster; larger pairs gain nothing.
__attribute__((target("avx512vl,avx512dq"), flatten)) void SearchEightByAvx512(
    const FloatPair& pair, double tolerance, const PlainVector& first, double max_error,
    const PlainVector* inner, FloatSearchResult& result) {
  const EightForAvx512 own(pair);
  Simplex simplex;
  FloatSearch(own, tolerance, max_error, simplex).Run(first, inner, result);
}
#endif

template <typename Pair>
void Search(const FloatPair& pair, double tolerance, const PlainVector& first, double max_error,
            const PlainVector* inner, FloatSearchResult& result) {
#ifdef HULLD_HAS_AVX2_PATH
  if (UsesAvx2()) {
    return SearchByAvx2<Pair>(pair, tolerance, first, max_error, inner, result);
  }
#endif
  SearchPortably<Pair>(pair, tolerance, first, max_error, inner, result);
}

void SearchEight(const FloatPair& pair, double tolerance, const PlainVector& first,
                 double max_error, const PlainVector* inner, FloatSearchResult& result) {
#ifdef HULLD_HAS_AVX2_PATH
  if (CurrentSimdPath() == SimdPath::kAvx512) {
    return SearchEightByAvx512(pair, tolerance, first, max_error, inner, result);
  }
  if (UsesAvx2()) {
    return SearchByAvx2<EightForAvx2>(pair, tolerance, first, max_error, inner, result);
  }
#endif
  SearchPortably<SmallPair<8>>(pair, tolerance, first, max_error, inner, result);
}

}  // namespace

void SearchInFloatingPoint(const FloatPair& pair, double tolerance, const PlainVector& first,
                           double max_error, const PlainVector* inner, FloatSearchResult& result) {
  HULLD_DCHECK(pair.usable());
  if (SmallPair<8>::Fits(pair)) {
    SearchEight(pair, tolerance, first, max_error, inner, result);
  } else if (SmallPair<16>::Fits(pair)) {
    Search<SmallPair<16>>(pair, tolerance, first, max_error, inner, result);
  } else {
    Search<FloatPair>(pair, tolerance, first, max_error, inner, result);
  }
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
      result.reach = value;
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
    if (ContainsOrigin(pair, difference(0), difference(1), difference(2), difference(3))) {
      result.verdict = FloatVerdict::kOverlapping;
      result.pair_count = 4;
      std::copy(cache.pairs, cache.pairs + 4, result.pairs.begin());
    }
  }
  return result;
}

}  // namespace hulld
