#include "core/query/exact/exact_depth.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/rational.h"
#include "core/query/floating/expanding_surface.h"
#include "core/query/terms/query_options.h"

namespace hulld {
namespace {

// Maximum number of seed vertices to insert, each in O(facets). The last ones are inserted, because
// they are nearest. Not tuned.
constexpr size_t kMaxSeeds = 1024;

// The plane n.w = offset of a facet, n outward. `key` is its signed distance from the origin in
// floating point, in units of a common power of two.
struct Plane {
  IntegerVector n;
  Integer offset;
  double key;
};

// Returns the sign of the difference of the signed distances of two planes.
int CompareDistance(const Plane& f, const Plane& g) {
  const int side = Sign(f.offset);
  if (side != Sign(g.offset)) return side < Sign(g.offset) ? -1 : 1;
  const Integer left = f.offset * f.offset * Dot(g.n, g.n);
  const Integer right = g.offset * g.offset * Dot(f.n, f.n);
  return left == right ? 0 : (left < right) == (side >= 0) ? -1 : 1;
}

class ExactExpansion {
 public:
  ExactExpansion(ExactPair& pair, uint64_t max_bytes, const std::function<bool()>& should_stop)
      : pair_(pair), max_bytes_(max_bytes), poll_(should_stop) {}

  absl::StatusOr<ExactNearest> Run(std::span<const VertexPair> seed) {
    if (!Start(seed)) return Stopped();
    for (const VertexPair& p : seed.last(std::min(seed.size(), kMaxSeeds))) {
      if (poll_.Poll()) return Stopped();
      Insert(pair_.Corner(p));
    }
    for (;;) {
      if (poll_.Poll()) return Stopped();
      if (MemoryBytes() > max_bytes_) return DepthTooLarge(max_bytes_);
      const uint32_t nearest = Nearest();
      if (poll_.stopped()) return Stopped();
      ExactCorner farthest = pair_.Farthest(planes_[nearest].n);
      if (pair_.stopped()) return Stopped();
      if (Dot(planes_[nearest].n, farthest.w) == planes_[nearest].offset) {
        HULLD_CHECK(Sign(planes_[nearest].offset) > 0);
        return PointOn(nearest);
      }
      Expand(nearest, std::move(farthest));
    }
  }

 private:
  static absl::Status Stopped() { return absl::CancelledError("the exact query was cancelled"); }

  // Approximate memory of the growing polytope, in bytes.
  size_t MemoryBytes() const {
    return pair_.MemoryBytes() + corners_.capacity() * sizeof(ExactCorner) +
           planes_.size() * sizeof(Plane) +
           surface_.facets().capacity() * sizeof(ExpandingSurface::Facet) +
           heap_.capacity() * sizeof(uint32_t);
  }

  // After a stop, the order of planes is arbitrary.
  bool IsNearer(const Plane& f, const Plane& g) const {
    if (poll_.Step()) return false;
    const double slack =
        kDepthKeyErrorFactor * std::max(std::abs(f.key), std::abs(g.key)) + kDepthKeyMin;
    if (f.key < g.key - slack) return true;
    if (f.key > g.key + slack) return false;
    return CompareDistance(f, g) < 0;
  }

  // The order of the heap. Its front is the nearest facet, the first one in a tie.
  struct IsLater {
    const ExactExpansion& expansion;
    bool operator()(uint32_t f, uint32_t g) const {
      const std::deque<Plane>& planes = expansion.planes_;
      if (expansion.IsNearer(planes[g], planes[f])) return true;
      return g < f && !expansion.IsNearer(planes[f], planes[g]);
    }
  };

  // Adds a corner for which differs(w) holds: one of the seed, or one that is farthest along or
  // against one of the directions. Returns false if should_stop returned true.
  template <typename Differs>
  bool AddCorner(std::span<const VertexPair> seed, std::vector<IntegerVector> directions,
                 Differs differs) {
    for (const VertexPair& p : seed) {
      if (poll_.Step()) return false;
      ExactCorner corner = pair_.Corner(p);
      if (!differs(corner.w)) continue;
      corners_.push_back(std::move(corner));
      return true;
    }
    for (const IntegerVector& n : directions) {
      for (const IntegerVector& toward : {n, -n}) {
        ExactCorner corner = pair_.Farthest(toward);
        if (pair_.stopped()) return false;
        if (!differs(corner.w)) continue;
        corners_.push_back(std::move(corner));
        return true;
      }
    }
    // A - B is solid.
    HULLD_UNREACHABLE();
  }

  // Builds a tetrahedron with corner 3 on the inner side of facet 0, 1, 2. One exists, because A -
  // B is solid. Returns false if should_stop returned true.
  bool Start(std::span<const VertexPair> seed) {
    if (!AddCorner(seed, {{1, 0, 0}}, [](const IntegerVector&) { return true; })) return false;
    const IntegerVector p = corners_[0].w;
    if (!AddCorner(seed, {{1, 0, 0}}, [&](const IntegerVector& w) { return !(w == p); })) {
      return false;
    }
    const IntegerVector e = corners_[1].w - p;
    if (!AddCorner(seed, {AnyPerpendicular(e)},
                   [&](const IntegerVector& w) { return !IsZero(Cross(e, w - p)); })) {
      return false;
    }
    const IntegerVector n = Cross(e, corners_[2].w - p);
    if (!AddCorner(seed, {n}, [&](const IntegerVector& w) { return Sign(Dot(n, w - p)) != 0; })) {
      return false;
    }
    if (Sign(Dot(n, corners_[3].w - p)) > 0) std::swap(corners_[1], corners_[2]);
    SetUnit();
    surface_.Start();
    AddPlanes(0);
    return true;
  }

  // Computes the size of the corners, for the keys.
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

  // Computes planes for all facets from `first` on.
  void AddPlanes(uint32_t first) {
    for (uint32_t i = first; i < surface_.facets().size(); ++i) {
      const auto& c = surface_.facets()[i].corners;
      const IntegerVector& p = corners_[c[0]].w;
      IntegerVector n = Cross(corners_[c[1]].w - p, corners_[c[2]].w - p);
      Integer offset = Dot(n, p);
      const double key = KeyOf(n, offset);
      planes_.push_back({std::move(n), std::move(offset), key});
      heap_.push_back(i);
      std::push_heap(heap_.begin(), heap_.end(), IsLater{*this});
    }
  }

  bool Sees(const ExactCorner& corner, uint32_t facet) const {
    return !poll_.Step() && Dot(planes_[facet].n, corner.w) > planes_[facet].offset;
  }

  // Requires: the corner strictly above the facet, unless should_stop returned true. The facets of
  // a convex polytope strictly below a point are connected, and so is their boundary, so the
  // surface always closes.
  void Expand(uint32_t facet, ExactCorner corner) {
    HULLD_DCHECK(Sees(corner, facet) || poll_.stopped());
    const auto apex = static_cast<uint32_t>(corners_.size());
    corners_.push_back(std::move(corner));
    const std::optional<uint32_t> first =
        surface_.Expand(facet, apex, [&](uint32_t i) { return Sees(corners_[apex], i); });
    HULLD_CHECK(first.has_value() || poll_.stopped());
    if (poll_.stopped()) return;
    AddPlanes(*first);
    if (surface_.HasManyDead()) Compact();
  }

  void Insert(ExactCorner corner) {
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      if (surface_.facets()[i].alive && Sees(corner, i)) return Expand(i, std::move(corner));
    }
  }

  // Drops dead facets.
  void Compact() {
    const std::vector<uint32_t> places = surface_.Compact();
    for (uint32_t i = 0; i < places.size(); ++i) {
      if (places[i] != ExpandingSurface::kGone && places[i] != i) {
        planes_[places[i]] = std::move(planes_[i]);
      }
    }
    planes_.resize(surface_.facets().size());
    heap_.resize(planes_.size());
    std::iota(heap_.begin(), heap_.end(), 0u);
    std::make_heap(heap_.begin(), heap_.end(), IsLater{*this});
  }

  // Returns the facet with the least signed distance, the first one in a tie.
  uint32_t Nearest() {
    while (!surface_.facets()[heap_.front()].alive) {
      std::pop_heap(heap_.begin(), heap_.end(), IsLater{*this});
      heap_.pop_back();
      HULLD_CHECK(!heap_.empty());
    }
    return heap_.front();
  }

  // Returns the foot of the perpendicular from the origin onto the facet's plane. The plane
  // supports A - B, and the foot lies in a triangle of that plane. CANCELLED: as for Run.
  absl::StatusOr<ExactNearest> PointOn(uint32_t facet) const {
    const Plane& plane = planes_[facet];
    const auto on_plane = [&](uint32_t corner) {
      return Dot(plane.n, corners_[corner].w) == plane.offset;
    };
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      if (poll_.Step()) return Stopped();
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
  const uint64_t max_bytes_;
  mutable StopPoll poll_;
  std::vector<ExactCorner> corners_;
  ExpandingSurface surface_;
  // A deque, because copying a vector of many planes when it grows delays the next poll.
  std::deque<Plane> planes_;
  // Facets by distance, including some dead ones.
  std::vector<uint32_t> heap_;
  int unit_exponent_ = INT32_MIN / 2;
};

}  // namespace

absl::StatusOr<ExactNearest> FindDepthExactly(ExactPair& pair, std::span<const VertexPair> seed,
                                              uint64_t max_bytes,
                                              const std::function<bool()>& should_stop) {
  return ExactExpansion(pair, max_bytes, should_stop).Run(seed);
}

}  // namespace hulld
