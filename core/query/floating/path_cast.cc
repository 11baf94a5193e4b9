#include "core/query/floating/path_cast.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/numeric/error_bounds.h"
#include "core/numeric/simd_path.h"
#include "core/query/floating/small_pair.h"

namespace hulld {
namespace {

// Maximum number of support vertices of a cast. A cast needs more only if rounding hinders it. Not
// tuned.
constexpr int kMaxSteps = 96;
// Share of the time up to a plane that its interval leaves open, more than rounding takes. Not
// tuned.
constexpr double kOpenShare = 0x1p-40;
// Weight of another point in the point that casts start from, so that symmetric hulls that move
// along their symmetry axis are not a special case. Not tuned.
constexpr double kOffCenter = 0x1p-5;

// A lower bound on the gap along a unit direction, at time 0 and changing with time.
struct Gap {
  double at_start;
  double speed;
  double error;

  double At(double time) const { return at_start + time * speed - error; }
};

// Returns the vector from c to the nearest point of the path along d.
PlainVector ToPath(const PlainVector& c, const PlainVector& d) {
  const double squared = SquaredNorm(d);
  const double time = squared > 0 ? std::clamp(Dot(c, d) / squared, 0.0, 1.0) : 0;
  return time * d - c;
}

// Pair: a FloatPair or a SmallPair.
template <typename Pair>
class Cast {
 public:
  Cast(const Pair& pair, const PlainVector& center, const RelativePath& path)
      : pair_(pair), d_(path.displacement), gap_error_(kTranslatedGapErrorFactor * path.size) {
    const PlainVector other = pair.Difference({0, 0});
    center_.w = center + kOffCenter * (other - center);
    center_.is_vertex = false;
  }

  PathCast Run() {
    if (FindPortal()) Refine();
    return result_;
  }

 private:
  // A vertex of C, or the point from which the cast starts.
  struct Corner {
    PlainVector w;
    VertexPair pair = {};
    bool is_vertex = true;
  };

  // Twice the signed area of the origin, x, and y in the projection along the path.
  double Turn(const PlainVector& x, const PlainVector& y) const { return Dot(d_, Cross(x, y)); }

  // Finds the vertex farthest along n. Returns false if the cast is over.
  bool Explore(const PlainVector& n, Corner& farthest) {
    const double length = Norm(n);
    if (!(length > 0) || ++steps_ > kMaxSteps) return false;
    const PlainVector unit = (1 / length) * n;
    const FloatPair::Support support = pair_.Farthest(unit);
    farthest = {pair_.Difference(support.pair), support.pair};
    return !TakeGap(unit, support.value);
  }

  // Takes a plane if it has a gap. Returns true if it separates the pair at all times.
  bool TakeGap(const PlainVector& n, double reach) {
    const double support_error = kSupportErrorFactor * LargestComponent(n) * pair_.size();
    const Gap gap = {-reach - support_error, Dot(n, d_), gap_error_};
    if (!(gap.At(0) > 0)) return false;
    double until = 1;
    if (!(gap.At(1) > 0)) {
      until = gap.At(0) / -gap.speed * (1 - kOpenShare);
      if (!(until > result_.separated_until && until < 1 && gap.At(until) > 0)) return false;
    }
    result_.separated_until = until;
    result_.direction = n;
    if (until < 1) return false;
    result_.outcome = PathCast::Outcome::kSeparated;
    return true;
  }

  // Finds a triangle of the center and two vertices that the line of the path crosses. In the
  // projection along the path, the segment between the vertices is moved away from the center until
  // it is beyond the origin. Returns false if the cast is over.
  bool FindPortal() {
    const PlainVector& c = center_.w;
    Corner p, q;
    if (!Explore(ToPath(c, d_), p)) return false;
    double side = Turn(p.w, c);
    if (side == 0) {
      if (!Explore(Cross(d_, c), p)) return false;
      side = Turn(p.w, c);
    }
    for (;;) {
      const PlainVector across = Cross(d_, p.w - c);
      if (!Explore(Dot(across, c) > 0 ? -across : across, q)) return false;
      const double side_of_q = Turn(q.w, c);
      if ((side_of_q > 0) != (side > 0)) break;
      if (q.pair == p.pair) return false;
      p = q;
      side = side_of_q;
    }
    Corner& left = side > 0 ? p : q;
    Corner& right = side > 0 ? q : p;
    for (;;) {
      const PlainVector across = Cross(d_, left.w - right.w);
      const PlainVector n = Dot(across, left.w - c) < 0 ? -across : across;
      if (Dot(n, left.w) >= 0) break;
      Corner w;
      if (!Explore(n, w)) return false;
      if (w.pair == left.pair || w.pair == right.pair) return false;
      (Turn(w.w, c) > 0 ? left : right) = w;
    }
    portal_ = {center_, left, right};
    return true;
  }

  // Moves the portal against the path.
  void Refine() {
    auto& [p, q, r] = portal_;
    if (Dot(Cross(q.w - p.w, r.w - p.w), d_) > 0) std::swap(q, r);
    for (;;) {
      const PlainVector n = Cross(q.w - p.w, r.w - p.w);
      // At time 0 the origin is beyond the portal.
      if (Dot(n, p.w) > 0 || !(Dot(n, d_) < 0)) return;
      Corner w;
      if (!Explore(n, w)) return;
      const bool is_corner = std::ranges::any_of(
          portal_, [&](const Corner& corner) { return corner.is_vertex && corner.pair == w.pair; });
      if (is_corner || !(Dot(n, w.w - p.w) > 0)) break;
      if (!Replace(w)) return;
    }
    if (!p.is_vertex || !q.is_vertex || !r.is_vertex) return;
    result_.outcome = PathCast::Outcome::kFacet;
    result_.facet = {p.pair, q.pair, r.pair};
  }

  // Replaces a corner so that the line of the path still crosses the portal. Its corners are
  // clockwise seen along the path.
  bool Replace(const Corner& w) {
    double turn[3];
    for (int i = 0; i < 3; ++i) turn[i] = Turn(w.w, portal_[i].w);
    for (int i = 0; i < 3; ++i) {
      if (turn[i] > 0 || turn[(i + 1) % 3] < 0) continue;
      portal_[(i + 2) % 3] = w;
      return true;
    }
    return false;
  }

  const Pair& pair_;
  const PlainVector d_;
  const double gap_error_;
  Corner center_;
  std::array<Corner, 3> portal_;
  int steps_ = 0;
  PathCast result_;
};

// Casts the path against the balls around the hulls.
PathCast CastBalls(const FloatPair& start, const RelativePath& path) {
  const PlainVector d = path.displacement;
  const PlainVector c = start.CenterDifference();
  const PlainVector to_path = ToPath(c, d);
  const double distance = Norm(to_path);
  PathCast cast;
  if (!(distance > 0)) return cast;
  const PlainVector n = (1 / distance) * to_path;
  const double reach = start.a().query_hull().radius() + start.b().query_hull().radius();
  const Gap gap = {-Dot(n, c) - reach, Dot(n, d), kTranslatedGapErrorFactor * path.size};
  if (!(gap.At(0) > 0 && gap.At(1) > 0)) return cast;
  cast.outcome = PathCast::Outcome::kSeparated;
  cast.separated_until = 1;
  cast.direction = n;
  return cast;
}

template <uint32_t kMaxVertices>
PathCast CastSmallPortably(const FloatPair& start, const RelativePath& path) {
  const SmallPair<kMaxVertices> small(start);
  return Cast(small, start.CenterDifference(), path).Run();
}

#ifdef HULLD_HAS_AVX2_PATH
// The entire call tree is compiled for AVX2, so that lanes stay in registers.
template <uint32_t kMaxVertices>
__attribute__((target("avx2"), flatten)) PathCast CastSmallAvx2(const FloatPair& start,
                                                                const RelativePath& path) {
  const SmallPair<kMaxVertices> small(start);
  return Cast(small, start.CenterDifference(), path).Run();
}
#else
template <uint32_t kMaxVertices>
PathCast CastSmallAvx2(const FloatPair& start, const RelativePath& path) {
  return CastSmallPortably<kMaxVertices>(start, path);
}
#endif

template <uint32_t kMaxVertices>
PathCast CastSmall(const FloatPair& start, const RelativePath& path) {
  return UsesAvx2() ? CastSmallAvx2<kMaxVertices>(start, path)
                    : CastSmallPortably<kMaxVertices>(start, path);
}

}  // namespace

RelativePath::RelativePath(const FloatPair& start, const Motion& X_WA, const Motion& X_WB) {
  const Vector of_a = X_WA.end.t - X_WA.start.t;
  const Vector of_b = X_WB.end.t - X_WB.start.t;
  displacement = of_b - of_a;
  length = of_a.cwiseAbs().maxCoeff() + of_b.cwiseAbs().maxCoeff();
  size = start.size() + length;
}

PathCast CastPath(const FloatPair& start, const RelativePath& path) {
  HULLD_DCHECK(start.usable() && IsFilterSize(path.size));
  if (const PathCast balls = CastBalls(start, path);
      balls.outcome == PathCast::Outcome::kSeparated) {
    return balls;
  }
  if (SmallPair<8>::Fits(start)) return CastSmall<8>(start, path);
  if (SmallPair<16>::Fits(start)) return CastSmall<16>(start, path);
  return Cast(start, start.CenterDifference(), path).Run();
}

}  // namespace hulld
