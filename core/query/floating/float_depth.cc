#include "core/query/floating/float_depth.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory_resource>
#include <optional>
#include <span>
#include <unordered_set>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/orientation.h"
#include "core/query/floating/expanding_surface.h"
#include "core/query/floating/nearest_part.h"
#include "core/query/terms/minkowski_vertex.h"

namespace hulld {
namespace {

// Minimum height of a vertex above a facet, relative to the pair's size, that removes the facet.
// Far below the default error, far above rounding: flat parts of A - B are not cut into slivers.
constexpr double kRelativeVisibility = 0x1p-46;
// Reserved capacity. Observed: links of a robot's arm need 15 vertices.
constexpr size_t kUsualVertices = 32;
constexpr size_t kUsualFacets = 192;
constexpr size_t kMaxVertices = size_t{1} << 18;
// Maximum number of corners that a lookup scans.
constexpr size_t kMaxScanned = 64;

using Corner = MinkowskiVertex<PlainVector>;

// The plane of a facet.
struct Plane {
  PlainVector n;  // unit length, outward
  // The least n . p over the facet's corners p.
  double distance = 0;
  // True if the corners are certainly counter-clockwise seen from outside, about the origin.
  bool outward = false;
};

// Memory for the usual polytope inside this object; larger polytopes use the heap. The object's
// memory is not reused after deallocation, so callers reserve the usual sizes.
class OwnMemory : public std::pmr::memory_resource {
 private:
  void* do_allocate(size_t bytes, size_t alignment) override {
    const size_t at = (used_ + alignment - 1) & ~(alignment - 1);
    if (at + bytes > sizeof own_) return heap_->allocate(bytes, alignment);
    used_ = at + bytes;
    return own_ + at;
  }
  void do_deallocate(void* p, size_t bytes, size_t alignment) override {
    const auto at = reinterpret_cast<uintptr_t>(p) - reinterpret_cast<uintptr_t>(own_);
    if (at >= sizeof own_) heap_->deallocate(p, bytes, alignment);
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }

  std::pmr::memory_resource* const heap_ = std::pmr::new_delete_resource();
  size_t used_ = 0;
  alignas(std::max_align_t) std::byte own_[20 * 1024];
};

class Expansion {
 public:
  Expansion(const FloatPair& pair, const SeparationGoal& goal, StopPoll& poll)
      : pair_(pair), goal_(goal), poll_(poll), unit_(UnitOf(pair.size())), per_unit_(1 / unit_) {
    corners_.reserve(kUsualVertices);
    planes_.reserve(kUsualFacets);
    heap_.reserve(kUsualFacets);
    surface_.Reserve(kUsualFacets);
  }

  SeparationBounds Run(std::span<const VertexPair> start, bool want_point) {
    if (Start(start)) {
      while (Step()) {
      }
    }
    if (poll_.stopped()) return bounds_;
    bounds_.low = ProvenLow();
    if (want_point && bounds_.low > 0) FindPoint();
    return bounds_;
  }

  void AppendVertices(std::vector<VertexPair>& vertices) const {
    for (const Corner& corner : corners_) vertices.push_back(corner.pair);
  }

 private:
  using Entry = std::pair<double, uint32_t>;  // a facet by its distance

  Corner At(VertexPair pair) const { return {per_unit_ * pair_.Difference(pair), pair}; }

  double HighOf(const FloatPair::Support& farthest) const {
    return farthest.value + kReachErrorFactor * pair_.size();
  }

  FloatPair::Support Reach(const PlainVector& n) {
    const FloatPair::Support farthest = pair_.Farthest(n);
    bounds_.high = std::min(bounds_.high, HighOf(farthest));
    return farthest;
  }

  // Builds a tetrahedron with corner 3 on the inner side of facet 0, 1, 2.
  bool Start(std::span<const VertexPair> start) {
    if (start.size() == 4) {
      for (const VertexPair& pair : start) corners_.push_back(At(pair));
    } else if (!SpanTetrahedron()) {
      return false;
    }
    const PlainVector n = Cross(corners_[1].w - corners_[0].w, corners_[2].w - corners_[0].w);
    if (Dot(n, corners_[3].w - corners_[0].w) > 0) std::swap(corners_[1], corners_[2]);
    surface_.Start();
    return AddPlanes(0);
  }

  // Adds the vertex farthest along or against n, choosing the one farther from corner 0.
  bool AddFarther(PlainVector n) {
    const double length = Norm(n);
    if (!(length > 0)) return false;
    n = (1 / length) * n;
    const VertexPair pairs[2] = {Reach(n).pair, Reach(-n).pair};
    double heights[2];
    for (int i = 0; i < 2; ++i) {
      heights[i] = std::abs(Dot(n, At(pairs[i]).w - corners_[0].w));
    }
    const int farther = heights[1] > heights[0];
    corners_.push_back(At(pairs[farther]));
    return heights[farther] > kRelativeVisibility;
  }

  bool SpanTetrahedron() {
    corners_.push_back(At(Reach({1, 0, 0}).pair));
    if (!AddFarther({1, 0, 0})) return false;
    const PlainVector e = corners_[1].w - corners_[0].w;
    const PlainVector across = Cross(e, {0, 1, 0});
    const PlainVector other = Cross(e, {0, 0, 1});
    if (!AddFarther(SquaredNorm(across) > SquaredNorm(other) ? across : other)) return false;
    return AddFarther(Cross(e, corners_[2].w - corners_[0].w));
  }

  // Computes planes for all facets from `first` on.
  bool AddPlanes(uint32_t first) {
    planes_.resize(surface_.facets().size());
    for (uint32_t i = first; i < planes_.size(); ++i) {
      const auto& corners = surface_.facets()[i].corners;
      const PlainVector& p = corners_[corners[0]].w;
      const PlainVector& q = corners_[corners[1]].w;
      const PlainVector& r = corners_[corners[2]].w;
      const PlainVector normal = Cross(q - p, r - p);
      const double length = Norm(normal);
      if (!(length > 0)) return false;
      const PlainVector n = (1 / length) * normal;
      const double distance = std::min(Dot(n, p), std::min(Dot(n, q), Dot(n, r)));
      planes_[i] = {n, distance, length * distance > kMinOutward};
      // A facet beyond the upper bound never becomes the nearest.
      if (distance * unit_ > bounds_.high) continue;
      heap_.emplace_back(distance, i);
      std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
    }
    return true;
  }

  // Returns the nearest facet; none if all are beyond the upper bound.
  std::optional<uint32_t> Nearest() {
    while (!heap_.empty() && !surface_.facets()[heap_.front().second].alive) {
      std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
      heap_.pop_back();
    }
    if (heap_.empty()) return std::nullopt;
    return heap_.front().second;
  }

  double Low(const std::optional<uint32_t>& nearest) const {
    if (!nearest) return bounds_.high;
    const double distance = planes_[*nearest].distance * unit_;
    return std::min(bounds_.high, distance - kTriangleDistanceErrorFactor * pair_.size());
  }

  // Scans a few corners, because a set needs allocations.
  bool Contains(VertexPair pair) {
    const size_t scanned = std::min(corners_.size(), kMaxScanned);
    const bool is_early =
        std::any_of(corners_.begin(), corners_.begin() + static_cast<ptrdiff_t>(scanned),
                    [&](const Corner& corner) { return corner.pair == pair; });
    while (late_.size() + scanned < corners_.size()) {
      late_.insert(KeyOf(corners_[late_.size() + scanned].pair));
    }
    return is_early || late_.contains(KeyOf(pair));
  }
  static uint64_t KeyOf(VertexPair pair) { return uint64_t{pair.a} << 32 | pair.b; }

  bool IsAbove(uint32_t facet, const Corner& corner) const {
    return Dot(planes_[facet].n, corner.w) > planes_[facet].distance + kRelativeVisibility;
  }

  // Expands the nearest facet. Returns false if the goal is met or no progress is possible.
  bool Step() {
    const std::optional<uint32_t> nearest = Nearest();
    if (!nearest || corners_.size() >= kMaxVertices) return false;
    if (corners_.size() > kUsualVertices && poll_.Step()) return false;
    const PlainVector n = planes_[*nearest].n;
    const double low = std::max(0.0, Low(nearest));
    const FloatPair::Support farthest = Reach(n);
    if (goal_.Met(low, bounds_.high)) return false;
    const Corner corner = At(farthest.pair);
    // The vertex is a known corner: the surface is not convex up to rounding.
    if (!IsAbove(*nearest, corner) || Contains(farthest.pair)) return false;
    corners_.push_back(corner);
    const PlainVector w = corner.w;
    const auto apex = static_cast<uint32_t>(corners_.size() - 1);
    const std::optional<uint32_t> first = surface_.Expand(*nearest, apex, [&](uint32_t i) {
      return Dot(planes_[i].n, w) > planes_[i].distance + kRelativeVisibility;
    });
    intact_ = first && AddPlanes(*first);
    if (intact_ && planes_.size() - *first > kUsualFacets) {
      poll_.Step((planes_.size() - *first) / kUsualFacets);
    }
    if (intact_ && surface_.HasManyDead()) Compact();
    return intact_;
  }

  // Drops dead facets.
  void Compact() {
    const std::vector<uint32_t> places = surface_.Compact();
    for (uint32_t i = 0; i < places.size(); ++i) {
      if (places[i] != ExpandingSurface::kGone) planes_[places[i]] = planes_[i];
    }
    planes_.resize(surface_.facets().size());
    std::erase_if(
        heap_, [&](const Entry& entry) { return places[entry.second] == ExpandingSurface::kGone; });
    for (Entry& entry : heap_) entry.second = places[entry.second];
    std::make_heap(heap_.begin(), heap_.end(), std::greater<>());
  }

  // Returns the proven lower bound; 0 if there is none.
  double ProvenLow() {
    if (!intact_ || planes_.empty()) return 0;
    const double low = Low(Nearest());
    if (!(low > 0)) return 0;
    bool some = false;
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      if (planes_.size() > kUsualFacets && poll_.Step()) return 0;
      if (!surface_.facets()[i].alive) continue;
      if (planes_[i].outward) {
        some = true;
        continue;
      }
      const auto& corners = surface_.facets()[i].corners;
      const int side = Orient3d(corners_[corners[0]].w, corners_[corners[1]].w,
                                corners_[corners[2]].w, Vector::Zero());
      if (side > 0) return 0;
      some |= side < 0;
    }
    return some ? low : 0;
  }

  // Finds the point of the surface nearest to the origin, on one of the triangles of the nearest
  // facet if that facet is flat.
  void FindPoint() {
    double least = INFINITY;
    uint32_t nearest = 0;
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      if (planes_.size() > kUsualFacets && poll_.Step()) return;
      if (!surface_.facets()[i].alive || planes_[i].distance * unit_ > bounds_.high) continue;
      const double length = Norm(NearestOn(i).point);
      if (!(length < least)) continue;
      least = length;
      nearest = i;
    }
    if (least == INFINITY) return;
    const NearestPart part = NearestOn(nearest);
    const auto& corners = surface_.facets()[nearest].corners;
    bounds_.direction = planes_[nearest].n;
    bounds_.facet_low = unit_ * LowAlong(planes_[nearest].n);
    bounds_.point_length = least * unit_;
    bounds_.point.count = part.count;
    for (uint32_t i = 0; i < part.count; ++i) {
      bounds_.point.pairs[i] = corners_[corners[part.corners[i]]].pair;
      bounds_.point.weights[i] = part.weights[i];
    }
  }

  // Returns the least n . p over the corners of facets that may be within the upper bound.
  double LowAlong(const PlainVector& n) const {
    const double max_distance =
        (bounds_.high + kTriangleDistanceErrorFactor * pair_.size()) * per_unit_;
    double low = INFINITY;
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      if (!surface_.facets()[i].alive || planes_[i].distance > max_distance) continue;
      for (const uint32_t corner : surface_.facets()[i].corners) {
        low = std::min(low, Dot(n, corners_[corner].w));
      }
    }
    return low;
  }

  NearestPart NearestOn(uint32_t facet) const {
    const auto& corners = surface_.facets()[facet].corners;
    return NearestOnTriangle(corners_[corners[0]].w, corners_[corners[1]].w,
                             corners_[corners[2]].w);
  }

  const FloatPair& pair_;
  const SeparationGoal& goal_;
  StopPoll& poll_;
  const double unit_;
  const double per_unit_;
  OwnMemory memory_;
  std::pmr::vector<Corner> corners_{&memory_};
  // Corners from kMaxScanned on.
  std::unordered_set<uint64_t> late_;
  ExpandingSurface surface_{&memory_};
  std::pmr::vector<Plane> planes_{&memory_};
  std::pmr::vector<Entry> heap_{&memory_};
  bool intact_ = true;
  SeparationBounds bounds_;
};

}  // namespace

SeparationBounds BoundDepth(const FloatPair& pair, std::span<const VertexPair> start,
                            const SeparationGoal& goal, bool want_point, StopPoll& poll,
                            std::vector<VertexPair>& vertices) {
  HULLD_CHECK(pair.usable());
  HULLD_CHECK(start.empty() || start.size() == 4);
  Expansion expansion(pair, goal, poll);
  const SeparationBounds bounds = expansion.Run(start, want_point);
  if (!goal.Met(bounds.low, bounds.high)) expansion.AppendVertices(vertices);
  return bounds;
}

}  // namespace hulld
