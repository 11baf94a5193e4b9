#ifndef HULLD_CORE_QUERY_FLOATING_EXPANDING_SURFACE_H_
#define HULLD_CORE_QUERY_FLOATING_EXPANDING_SURFACE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace hulld {

// A closed surface of triangles that grows by cones over parts of itself: the combinatorial half of
// an expanding polytope, for whatever arithmetic. Facets are counter-clockwise seen from outside.
class ExpandingSurface {
 public:
  struct Facet {
    std::array<uint32_t, 3> corners;
    // Across the edge from corner i to corner i + 1: the facet, and which of its edges it is there.
    std::array<uint32_t, 3> neighbors;
    std::array<uint8_t, 3> their_edges;
    bool alive = true;
  };

  // All facets that ever were; those that are not alive keep their places.
  const std::vector<Facet>& facets() const { return facets_; }

  // Sets memory aside for as many facets, dead ones included.
  void Reserve(size_t count) {
    facets_.reserve(count);
    horizon_.reserve(count);
    stack_.reserve(count);
  }

  // The four facets of a tetrahedron of the vertices 0 to 3, of which 3 is inside of the facet 0,
  // 1, 2.
  void Start() {
    facets_ = {{{0, 1, 2}, {1, 2, 3}, {2, 2, 2}},
               {{0, 3, 1}, {3, 2, 0}, {1, 0, 0}},
               {{1, 3, 2}, {1, 3, 0}, {1, 0, 1}},
               {{2, 3, 0}, {2, 1, 0}, {1, 0, 2}}};
  }

  // Removes the facets that are connected to `start` through facets for which visible(facet) holds,
  // and closes the gap by triangles from its edge to the vertex `apex`. Returns the index of the
  // first of these triangles, which are the last facets. Returns nothing, and leaves a surface of
  // no further use, when the edge of the gap is not one closed loop. `start` is taken to be
  // visible.
  template <typename Visible>
  std::optional<uint32_t> Expand(uint32_t start, uint32_t apex, Visible visible) {
    horizon_.clear();
    stack_.clear();
    facets_[start].alive = false;
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
      Push(facet, (side.edge + 2) % 3);
      Push(facet, (side.edge + 1) % 3);
    }
    return AddCone(apex);
  }

 private:
  struct Side {
    uint32_t facet;
    uint8_t edge;
  };

  void Push(const Facet& facet, int edge) {
    stack_.push_back({facet.neighbors[edge], facet.their_edges[edge]});
  }

  // The sides of the horizon follow each other round the gap.
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

  std::vector<Facet> facets_;
  std::vector<Side> horizon_;
  std::vector<Side> stack_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_EXPANDING_SURFACE_H_
