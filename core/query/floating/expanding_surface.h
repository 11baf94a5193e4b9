#ifndef HULLD_CORE_QUERY_FLOATING_EXPANDING_SURFACE_H_
#define HULLD_CORE_QUERY_FLOATING_EXPANDING_SURFACE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <vector>

namespace hulld {

// A closed surface of triangles that grows by cones over parts of itself: the combinatorial half of
// an expanding polytope, for any arithmetic. Facets are counter-clockwise seen from outside.
class ExpandingSurface {
 public:
  struct Facet {
    std::array<uint32_t, 3> corners;
    // Across the edge from corner i to corner i + 1: the neighboring facet, and the index of the
    // edge there.
    std::array<uint32_t, 3> neighbors;
    std::array<uint8_t, 3> their_edges;
    bool alive = true;
  };

  // `memory` must outlive this; the facets and lists are allocated from it.
  explicit ExpandingSurface(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
      : facets_(memory), horizon_(memory), stack_(memory) {}

  // All facets. Dead facets keep their places until Compact().
  const std::pmr::vector<Facet>& facets() const { return facets_; }

  // True if there are many facets and most of them are dead.
  bool HasManyDead() const { return facets_.size() >= kMinCompacted && dead_ > facets_.size() / 2; }
  // Removes dead facets and preserves the order of live ones. Returns the new index of each facet,
  // kGone if dropped. Cost: O(facets), so amortized O(1) for each facet created.
  static constexpr uint32_t kGone = UINT32_MAX;
  std::vector<uint32_t> Compact() {
    std::vector<uint32_t> places(facets_.size(), kGone);
    uint32_t count = 0;
    for (uint32_t i = 0; i < facets_.size(); ++i) {
      if (!facets_[i].alive) continue;
      places[i] = count;
      facets_[count++] = facets_[i];
    }
    facets_.resize(count);
    for (Facet& facet : facets_) {
      for (uint32_t& neighbor : facet.neighbors) neighbor = places[neighbor];
    }
    dead_ = 0;
    return places;
  }

  // Reserves memory for `count` facets, including dead ones.
  void Reserve(size_t count) {
    facets_.reserve(count);
    horizon_.reserve(count);
    stack_.reserve(count);
  }

  // Creates the four facets of a tetrahedron of the vertices 0 to 3. Vertex 3 is on the inner side
  // of facet 0, 1, 2.
  void Start() {
    facets_ = {{{0, 1, 2}, {1, 2, 3}, {2, 2, 2}},
               {{0, 3, 1}, {3, 2, 0}, {1, 0, 0}},
               {{1, 3, 2}, {1, 3, 0}, {1, 0, 1}},
               {{2, 3, 0}, {2, 1, 0}, {1, 0, 2}}};
  }

  // Removes the facets that are connected to `start` through facets for which visible(facet) is
  // true, and closes the gap by triangles from its edge to the vertex `apex`. Returns the index of
  // the first of these triangles, which are the last facets. If the edge of the gap is not a single
  // closed loop, returns nothing and leaves an unusable surface. `start` is assumed visible.
  template <typename Visible>
  std::optional<uint32_t> Expand(uint32_t start, uint32_t apex, Visible visible) {
    horizon_.clear();
    stack_.clear();
    facets_[start].alive = false;
    ++dead_;
    for (int i = 2; i >= 0; --i) Push(facets_[start], i);
    while (!stack_.empty()) {
      const Side side = stack_.back();
      stack_.pop_back();
      Facet& facet = facets_[side.facet];
      if (!facet.alive) continue;
      if (!visible(side.facet)) {
        horizon_.push_back(side);
        continue;
      }
      facet.alive = false;
      ++dead_;
      Push(facet, (side.edge + 2) % 3);
      Push(facet, (side.edge + 1) % 3);
    }
    return AddCone(apex);
  }

 private:
  static constexpr size_t kMinCompacted = 4096;

  struct Side {
    uint32_t facet;
    uint8_t edge;
  };

  void Push(const Facet& facet, int edge) {
    stack_.push_back({facet.neighbors[edge], facet.their_edges[edge]});
  }

  // Consecutive sides of the horizon are adjacent around the gap.
  std::optional<uint32_t> AddCone(uint32_t apex) {
    const auto first = static_cast<uint32_t>(facets_.size());
    const auto count = static_cast<uint32_t>(horizon_.size());
    if (count < 3) return std::nullopt;
    for (uint32_t i = 0; i < count; ++i) {
      const Side side = horizon_[i];
      Facet& outer = facets_[side.facet];
      const uint32_t tail = outer.corners[(side.edge + 1) % 3];
      const uint32_t head = outer.corners[side.edge];
      const Side next = horizon_[(i + 1) % count];
      if (facets_[next.facet].corners[(next.edge + 1) % 3] != head) return std::nullopt;
      outer.neighbors[side.edge] = first + i;
      outer.their_edges[side.edge] = 0;
      facets_.push_back({{tail, head, apex},
                         {side.facet, first + (i + 1) % count, first + (i + count - 1) % count},
                         {side.edge, 2, 1}});
    }
    return first;
  }

  std::pmr::vector<Facet> facets_;
  size_t dead_ = 0;
  std::pmr::vector<Side> horizon_;
  std::pmr::vector<Side> stack_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_EXPANDING_SURFACE_H_
