#include "core/query/exact/exact_depth.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/rational.h"
#include "core/query/floating/expanding_surface.h"

namespace hulld {
namespace {

// The plane n.w = offset of a facet, n outward; `key` is its signed distance from the origin in
// floating point, in units of a common power of two.
struct Plane {
  IntegerVector n;
  Integer offset;
  double key;
};

// Sign of the difference of the signed distances of two planes.
int CompareDistance(const Plane& f, const Plane& g) {
  const int side = Sign(f.offset);
  if (side != Sign(g.offset)) return side < Sign(g.offset) ? -1 : 1;
  const Integer left = f.offset * f.offset * Dot(g.n, g.n);
  const Integer right = g.offset * g.offset * Dot(f.n, f.n);
  return left == right ? 0 : (left < right) == (side >= 0) ? -1 : 1;
}

class ExactExpansion {
 public:
  ExactExpansion(ExactPair& pair, const std::function<bool()>& should_stop)
      : pair_(pair), poll_(should_stop, 1) {}

  absl::StatusOr<ExactNearest> Run(std::span<const VertexPair> seed) {
    Start(seed);
    for (const VertexPair& p : seed) Insert(pair_.Corner(p));
    for (;;) {
      if (poll_.Step()) return absl::CancelledError("stopped in an exact query");
      const uint32_t nearest = Nearest();
      ExactCorner farthest = pair_.Farthest(planes_[nearest].n);
      if (Dot(planes_[nearest].n, farthest.w) == planes_[nearest].offset) {
        HULLD_CHECK(Sign(planes_[nearest].offset) > 0);
        return PointOn(nearest);
      }
      Expand(nearest, std::move(farthest));
    }
  }

 private:
  // Adds a corner for which differs(w) holds: one of the seed, or one that is farthest along one of
  // the directions or against it.
  template <typename Differs>
  void AddCorner(std::span<const VertexPair> seed, std::vector<IntegerVector> directions,
                 Differs differs) {
    for (const VertexPair& p : seed) {
      ExactCorner corner = pair_.Corner(p);
      if (differs(corner.w)) return corners_.push_back(std::move(corner));
    }
    for (const IntegerVector& n : directions) {
      for (const IntegerVector& towards : {n, -n}) {
        ExactCorner corner = pair_.Farthest(towards);
        if (differs(corner.w)) return corners_.push_back(std::move(corner));
      }
    }
    // A - B is solid.
    HULLD_UNREACHABLE();
  }

  // A tetrahedron, its corner 3 inside of its facet 0, 1, 2. There is one: A - B is solid.
  void Start(std::span<const VertexPair> seed) {
    AddCorner(seed, {{1, 0, 0}}, [](const IntegerVector&) { return true; });
    const IntegerVector p = corners_[0].w;
    AddCorner(seed, {{1, 0, 0}}, [&](const IntegerVector& w) { return !(w == p); });
    const IntegerVector e = corners_[1].w - p;
    const IntegerVector across = AnyPerpendicular(e);
    AddCorner(seed, {across}, [&](const IntegerVector& w) { return !IsZero(Cross(e, w - p)); });
    IntegerVector n = Cross(e, corners_[2].w - p);
    AddCorner(seed, {n}, [&](const IntegerVector& w) { return Sign(Dot(n, w - p)) != 0; });
    if (Sign(Dot(n, corners_[3].w - p)) > 0) std::swap(corners_[1], corners_[2]);
    SetUnit();
    surface_.Start();
    AddPlanes(0);
  }

  // The size of the corners, for the keys.
  void SetUnit() {
    for (const ExactCorner& corner : corners_) {
      for (int i = 0; i < 3; ++i) {
        if (corner.w[i].is_zero()) continue;
        unit_exponent_ = std::max(unit_exponent_, ToScaledDouble(corner.w[i]).exponent + 62);
      }
    }
  }

  double KeyOf(const IntegerVector& n, const Integer& offset) const {
    ScaledDouble components[3];
    int exponent = INT32_MIN / 2;
    for (int i = 0; i < 3; ++i) {
      components[i] = ToScaledDouble(n[i]);
      if (!n[i].is_zero()) exponent = std::max(exponent, components[i].exponent);
    }
    double squared = 0;
    for (const ScaledDouble& c : components) {
      const double value = std::ldexp(c.mantissa, c.exponent - exponent);
      squared += value * value;
    }
    const ScaledDouble height = ToScaledDouble(offset);
    return std::ldexp(height.mantissa / std::sqrt(squared),
                      height.exponent - exponent - unit_exponent_);
  }

  // For all facets from `first` on.
  void AddPlanes(uint32_t first) {
    for (uint32_t i = first; i < surface_.facets().size(); ++i) {
      const auto& c = surface_.facets()[i].corners;
      const IntegerVector& p = corners_[c[0]].w;
      IntegerVector n = Cross(corners_[c[1]].w - p, corners_[c[2]].w - p);
      Integer offset = Dot(n, p);
      const double key = KeyOf(n, offset);
      planes_.push_back({std::move(n), std::move(offset), key});
    }
  }

  bool Sees(const ExactCorner& corner, uint32_t facet) const {
    return Dot(planes_[facet].n, corner.w) > planes_[facet].offset;
  }

  // Requires the corner strictly above the facet. A convex polytope's facets strictly below a point
  // are connected, and so is their edge, so that the surface always closes.
  void Expand(uint32_t facet, ExactCorner corner) {
    HULLD_DCHECK(Sees(corner, facet));
    const auto apex = static_cast<uint32_t>(corners_.size());
    corners_.push_back(std::move(corner));
    const std::optional<uint32_t> first =
        surface_.Expand(facet, apex, [&](uint32_t i) { return Sees(corners_[apex], i); });
    HULLD_CHECK(first.has_value());
    AddPlanes(*first);
  }

  void Insert(ExactCorner corner) {
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      if (surface_.facets()[i].alive && Sees(corner, i)) return Expand(i, std::move(corner));
    }
  }

  // The first of the facets at the least signed distance.
  uint32_t Nearest() const {
    std::optional<uint32_t> nearest;
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      if (!surface_.facets()[i].alive) continue;
      if (!nearest || IsNearer(planes_[i], planes_[*nearest])) nearest = i;
    }
    HULLD_CHECK(nearest.has_value());
    return *nearest;
  }

  static bool IsNearer(const Plane& f, const Plane& g) {
    const double slack =
        kDepthKeyErrorFactor * std::max(std::abs(f.key), std::abs(g.key)) + kDepthKeyMin;
    if (f.key < g.key - slack) return true;
    if (f.key > g.key + slack) return false;
    return CompareDistance(f, g) < 0;
  }

  // The foot of the perpendicular from the origin onto the facet's plane, which supports A - B: it
  // lies in a triangle of that plane.
  ExactNearest PointOn(uint32_t facet) const {
    const Plane& plane = planes_[facet];
    const auto on_plane = [&](uint32_t corner) {
      return Dot(plane.n, corners_[corner].w) == plane.offset;
    };
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      const auto& c = surface_.facets()[i].corners;
      if (!surface_.facets()[i].alive || !std::all_of(c.begin(), c.end(), on_plane)) continue;
      const IntegerVector& n = planes_[i].n;
      Integer weights[3];
      bool inside = true;
      for (int k = 0; k < 3; ++k) {
        weights[k] = Dot(n, Cross(corners_[c[(k + 1) % 3]].w, corners_[c[(k + 2) % 3]].w));
        inside &= Sign(weights[k]) >= 0;
      }
      if (!inside) continue;
      ExactNearest nearest;
      for (int k = 0; k < 3; ++k) {
        if (weights[k].is_zero()) continue;
        nearest.point.pairs.push_back(corners_[c[k]].pair);
        nearest.point.weights.push_back(weights[k]);
      }
      nearest.denominator = Dot(n, n);
      nearest.point.weight_sum = nearest.denominator;
      nearest.numerator = planes_[i].offset * planes_[i].offset;
      return nearest;
    }
    HULLD_UNREACHABLE();
  }

  ExactPair& pair_;
  StopPoll poll_;
  std::vector<ExactCorner> corners_;
  ExpandingSurface surface_;
  std::vector<Plane> planes_;
  int unit_exponent_ = INT32_MIN / 2;
};

}  // namespace

absl::StatusOr<ExactNearest> FindDepthExactly(ExactPair& pair, std::span<const VertexPair> seed,
                                              const std::function<bool()>& should_stop) {
  return ExactExpansion(pair, should_stop).Run(seed);
}

}  // namespace hulld
