#include "core/hull/growth/canonical_snapshot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"

namespace hulld {
namespace {

// Number of elements between the prefetch of data that is scattered in memory and its use.
constexpr size_t kAhead = 16;

// A vertex being sorted into canonical order.
struct Ranked {
  double x;
  VertexId id;
};

// Sorts a span that is usually very short.
template <typename T, typename Less>
void SortFew(std::span<T> few, Less&& is_less) {
  constexpr size_t kFew = 16;
  if (few.size() > kFew) return std::sort(few.begin(), few.end(), is_less);
  for (size_t i = 1; i < few.size(); ++i) {
    const T moving = few[i];
    size_t k = i;
    for (; k > 0 && is_less(moving, few[k - 1]); --k) few[k] = few[k - 1];
    few[k] = moving;
  }
}

void Sort(const VertexTable& vertices, std::span<Ranked> ranked) {
  SortFew(ranked, [&vertices](const Ranked& a, const Ranked& b) {
    if (a.x != b.x) return a.x < b.x;
    const Vector& p = vertices[a.id];
    const Vector& q = vertices[b.id];
    return p.y() != q.y() ? p.y() < q.y() : p.z() < q.z();
  });
}

// Sorts into canonical order. If the poll stopped, the result is meaningless.
//
// The x coordinates of most hulls are spread out. With as many slices across x as vertices, each
// slice has few vertices, and comparisons are needed only within a slice. The slice of an x is a
// composition of rounded monotonic operations, so slices are in order for any rounding.
std::vector<Ranked> SortedByPoint(const VertexTable& table, std::vector<Ranked> vertices,
                                  StopPoll& poll) {
  // The range is not sliced if its length overflows or is zero.
  double least = INFINITY;
  double largest = -INFINITY;
  for (const Ranked& v : vertices) {
    if (poll.Step()) return vertices;
    least = std::min(least, v.x);
    largest = std::max(largest, v.x);
  }
  const double scale = static_cast<double>(vertices.size()) / (largest - least);
  constexpr size_t kWorthSlicing = 32;
  if (vertices.size() < kWorthSlicing || !(scale > 0 && scale <= kLargestDouble)) {
    Sort(table, vertices);
    return vertices;
  }
  const auto last = static_cast<double>(vertices.size() - 1);
  const auto slice_of = [&](const Ranked& v) {
    return static_cast<size_t>(std::min((v.x - least) * scale, last));
  };
  // ends[s]: the start of slice s, which advances to its end as the slice fills.
  std::vector<uint32_t> ends(vertices.size(), 0);
  for (const Ranked& v : vertices) {
    if (poll.Step()) return vertices;
    ++ends[slice_of(v)];
  }
  uint32_t begin = 0;
  for (uint32_t& end : ends) begin += std::exchange(end, begin);
  std::vector<Ranked> sorted(vertices.size());
  for (const Ranked& v : vertices) {
    if (poll.Step()) return vertices;
    sorted[ends[slice_of(v)]++] = v;
  }
  uint32_t first = 0;
  for (const uint32_t end : ends) {
    if (poll.Step()) break;
    if (end - first > 1) Sort(table, std::span(sorted).subspan(first, end - first));
    first = end;
  }
  return sorted;
}

// The canonical order of vertices: index_of[id] is the index of vertex `id` in `points`.
struct Ranking {
  std::vector<Vector> points;
  std::vector<uint32_t> index_of;
};

// Ranks all live vertices. If the poll stopped, the result is meaningless.
Ranking Rank(const VertexTable& vertices, StopPoll& poll) {
  std::vector<Ranked> ranked;
  ranked.reserve(vertices.size());
  for (VertexId id = 0; id < vertices.id_bound(); ++id) {
    if (poll.Step()) return {};
    if (vertices.IsAlive(id)) ranked.push_back({vertices[id].x(), id});
  }
  ranked = SortedByPoint(vertices, std::move(ranked), poll);
  if (poll.stopped()) return {};
  Ranking ranking;
  ranking.points.resize(ranked.size());
  ranking.index_of.resize(vertices.id_bound());
  for (size_t i = 0; i < ranked.size(); ++i) {
    if (poll.Step()) return {};
    if (const size_t ahead = i + kAhead; ahead < ranked.size()) {
      __builtin_prefetch(&vertices[ranked[ahead].id]);
      __builtin_prefetch(&ranking.index_of[ranked[ahead].id], 1);
    }
    ranking.index_of[ranked[i].id] = static_cast<uint32_t>(i);
    ranking.points[i] = vertices[ranked[i].id];
  }
  return ranking;
}

// Facets and edges of a hull of dimension 3 in canonical order.
struct Faces {
  std::vector<uint32_t> facet_starts;
  std::vector<uint32_t> facet_vertices;
  std::vector<Edge> edges;
};

// One call of SnapshotOf.
//
// An edge between facets is traversed once in each direction, each time with another facet to the
// left. It is recorded at its lower vertex, together with the facet to the left if it is the first
// edge of that facet. The few edges recorded at a vertex are sorted by their higher vertex. This
// yields edges and facets in canonical order, because the second vertex alone distinguishes a
// facet from the other facets that start at the same vertex.
class FaceCollector {
 public:
  FaceCollector(const VertexTable& vertices, const Surface& surface, const Ranking& ranking)
      : vertices_(vertices),
        surface_(surface),
        ranking_(ranking),
        flags_(surface.id_bound(), 0),
        ranks_(std::make_unique_for_overwrite<Ranks[]>(surface.id_bound())),
        departures_at_(ranking.points.size() + 1, 0) {
    polygon_starts_.push_back(0);
  }

  // Returns false if stopped.
  bool Run(StopPoll& poll) {
    ReadTriangles(poll);
    if (poll.stopped()) return false;
    TracePolygons(poll);
    if (poll.stopped()) return false;
    CountDepartures(poll);
    if (poll.stopped()) return false;
    WriteDepartures(poll);
    return !poll.stopped();
  }

  // Returns the faces, or nothing if stopped. Requires: Run completed. Call at most once.
  std::optional<Faces> Assemble(StopPoll& poll) {
    Faces faces;
    // Sized exactly, because a snapshot is long-lived and never grows.
    faces.facet_starts.resize(triangle_facets_ + polygon_starts_.size());
    faces.facet_vertices.resize(3 * triangle_facets_ + polygon_vertices_.size());
    faces.edges.resize(departure_count_);
    uint32_t* facet_end = faces.facet_starts.data() + 1;
    uint32_t* const vertices = faces.facet_vertices.data();
    uint32_t* vertex = vertices;
    const auto vertex_count = static_cast<uint32_t>(ranking_.points.size());
    uint32_t first = 0;
    for (uint32_t tail = 0; tail < vertex_count; ++tail) {
      if (poll.Step()) return std::nullopt;
      // After WriteDepartures, this is the end of the departures.
      const uint32_t end = departures_at_[tail];
      SortFew(std::span(departures_.get() + first, end - first),
              [](const Departure& a, const Departure& b) { return a.head < b.head; });
      for (; first < end; ++first) {
        const Departure& d = departures_[first];
        faces.edges[first] = {tail, d.head};
        if (d.next <= tail) continue;
        if (d.next < vertex_count) {
          *vertex++ = tail;
          *vertex++ = d.head;
          *vertex++ = d.next;
        } else {
          const std::span<const uint32_t> polygon = Polygon(d.next - vertex_count);
          vertex = std::copy(polygon.begin(), polygon.end(), vertex);
        }
        *facet_end++ = static_cast<uint32_t>(vertex - vertices);
      }
    }
    HULLD_CHECK(facet_end == faces.facet_starts.data() + faces.facet_starts.size());
    return faces;
  }

 private:
  // Flags of a triangle: bit i is set if edge i lies within a facet, the fourth bit if the facet
  // has been found.
  static constexpr uint8_t kAnyFlat = 7;
  static constexpr uint8_t kVisited = 8;

  // An edge from its lower vertex to its higher one.
  struct Departure {
    uint32_t head;
    // If the facet to the left is a triangle: its third vertex. If it is a polygon that starts with
    // this edge: the number of vertices plus the polygon's index. Otherwise 0. A facet starts with
    // this edge if this value is above the edge's lower vertex.
    uint32_t next;
  };

  using Ranks = std::array<uint32_t, 3>;
  std::span<const uint32_t> Polygon(size_t k) const {
    return std::span(polygon_vertices_)
        .subspan(polygon_starts_[k], polygon_starts_[k + 1] - polygon_starts_[k]);
  }

  uint32_t RankOf(const SurfaceTriangle& t, size_t corner) const {
    return ranking_.index_of[t.corners[corner]];
  }
  // Rotates the ranks so that the lowest one comes first.
  static Ranks FromLowest(const Ranks& ranks) {
    const auto [a, b, c] = ranks;
    if (b < a && b < c) return {b, c, a};
    if (c < a && c < b) return {c, a, b};
    return ranks;
  }

  // Finds the flat edges and the ranks of corners, and counts the departures of each triangle as if
  // it were a facet: in one pass, because a large surface exceeds the caches. Edges at which a
  // triangle was joined to an older one already record if they are flat. Triangles created together
  // share an apex; for each of these, tests the edge to the next triangle around the apex.
  void ReadTriangles(StopPoll& poll) {
    const auto neighbor = [this](size_t id) -> const SurfaceTriangle& {
      return surface_.triangle(surface_.triangle(static_cast<TriangleId>(id)).neighbors[1]);
    };
    const auto none = static_cast<uint32_t>(ranking_.points.size());
    const size_t end = surface_.id_bound();
    for (TriangleId id = 0; id < end; ++id) {
      if (poll.Step()) return;
      // Prefetches triangles first, then their neighbors, vertices, and ranks, which are scattered
      // in memory. Not a function, because compilers drop calls without effect.
      if (const size_t ahead = id + 2 * kAhead; ahead < end) {
        __builtin_prefetch(&surface_.triangle(static_cast<TriangleId>(ahead)));
      }
      if (const size_t ahead = id + kAhead; ahead < end) {
        __builtin_prefetch(&neighbor(ahead));
        __builtin_prefetch(&vertices_[neighbor(ahead - kAhead / 2).corners[1]]);
        if (surface_.IsAlive(static_cast<TriangleId>(ahead))) {
          for (const VertexId v : surface_.triangle(static_cast<TriangleId>(ahead)).corners) {
            __builtin_prefetch(&ranking_.index_of[v]);
          }
        }
      }
      if (id >= kAhead / 2) AddToDepartures(ranks_[id - kAhead / 2], 1);
      ranks_[id] = {none, none, none};
      if (!surface_.IsAlive(id)) continue;
      const SurfaceTriangle& t = surface_.triangle(id);
      flags_[id] |= t.flat;
      ++triangle_facets_;
      ranks_[id] = FromLowest({RankOf(t, 0), RankOf(t, 1), RankOf(t, 2)});
      for (const uint32_t rank : ranks_[id]) __builtin_prefetch(&departures_at_[rank]);
      const TriangleId next = t.neighbors[1];
      const SurfaceTriangle& other = surface_.triangle(next);
      if (other.corners[2] != t.corners[2]) continue;
      HULLD_CHECK(other.neighbors[2] == id);
      if (surface_.IsInPlane(vertices_, id, vertices_[other.corners[1]])) {
        flags_[id] |= 1 << 1;
        flags_[next] |= 1 << 2;
      }
    }
    for (size_t id = end - std::min(end, kAhead / 2); id < end; ++id) {
      AddToDepartures(ranks_[id], 1);
    }
  }

  void TracePolygons(StopPoll& poll) {
    for (TriangleId id = 0; id < flags_.size() && !poll.stopped(); ++id) {
      if ((flags_[id] & kAnyFlat) == 0 || (flags_[id] & kVisited) != 0) continue;
      // A triangle with all edges within its facet is reached from its neighbors.
      uint32_t edge = 0;
      while (edge < 3 && IsFlat(id, edge)) ++edge;
      if (edge < 3) TracePolygon(id, edge, poll);
    }
  }
  bool IsFlat(TriangleId id, uint32_t edge) const { return (flags_[id] >> edge & 1) != 0; }

  // Walks around one facet, from one edge of its boundary to the next through the triangles around
  // the vertex between them. This reaches all triangles of the facet, because each has its corners
  // on the boundary.
  void TracePolygon(TriangleId first, uint32_t first_edge, StopPoll& poll) {
    const size_t start = polygon_vertices_.size();
    TriangleId id = first;
    uint32_t edge = first_edge;
    // Bound on the steps of a correct walk: through each corner of each triangle at most once.
    size_t steps_left = 3 * surface_.triangle_count();
    do {
      if (poll.Step()) return;
      polygon_vertices_.push_back(RankOf(surface_.triangle(id), edge));
      flags_[id] |= kVisited;
      edge = (edge + 1) % 3;
      while (IsFlat(id, edge)) {
        HULLD_CHECK(steps_left-- > 0);
        const TriangleId across = surface_.triangle(id).neighbors[edge];
        const auto& back = surface_.triangle(across).neighbors;
        edge = back[0] == id ? 1 : back[1] == id ? 2 : 0;
        id = across;
        flags_[id] |= kVisited;
      }
      HULLD_CHECK(steps_left-- > 0);
    } while (id != first || edge != first_edge);
    const auto polygon = polygon_vertices_.begin() + static_cast<ptrdiff_t>(start);
    std::rotate(polygon, std::min_element(polygon, polygon_vertices_.end()),
                polygon_vertices_.end());
    polygon_starts_.push_back(static_cast<uint32_t>(polygon_vertices_.size()));
  }

  // Calls visit(tail, head, next) for every edge of a triangular facet or a polygon that leads from
  // a lower vertex to a higher one. In a triangle, that is the first edge and perhaps the second;
  // if not, it is visited with the number of vertices as its tail, because a branch would be
  // unpredictable.
  template <typename Visitor>
  void ForEachTriangleDeparture(const Ranks& ranks, Visitor&& visit) const {
    const auto [a, b, c] = ranks;
    visit(a, b, c);
    visit(b < c ? b : static_cast<uint32_t>(ranking_.points.size()), c, 0);
  }
  template <typename Visitor>
  void ForEachPolygonDeparture(size_t k, Visitor&& visit) const {
    const std::span<const uint32_t> polygon = Polygon(k);
    visit(polygon[0], polygon[1], static_cast<uint32_t>(ranking_.points.size() + k));
    for (size_t i = 1; i + 1 < polygon.size(); ++i) {
      if (polygon[i] < polygon[i + 1]) visit(polygon[i], polygon[i + 1], 0);
    }
  }

  // Adds `change`, which is 1 or -1, to the count of departures at each tail of a triangle.
  void AddToDepartures(const Ranks& ranks, int change) {
    ForEachTriangleDeparture(ranks, [&](uint32_t tail, uint32_t, uint32_t) {
      departures_at_[tail] += static_cast<uint32_t>(change);
    });
  }

  // Corrects the counts for facets of several triangles, and sets departures_at_[v] to the start of
  // the departures at vertex v.
  void CountDepartures(StopPoll& poll) {
    for (TriangleId id = 0; id < flags_.size(); ++id) {
      if ((flags_[id] & kAnyFlat) == 0) continue;
      if (poll.Step()) return;
      AddToDepartures(ranks_[id], -1);
      ranks_[id].fill(static_cast<uint32_t>(ranking_.points.size()));
      --triangle_facets_;
    }
    for (size_t k = 0; k + 1 < polygon_starts_.size(); ++k) {
      ForEachPolygonDeparture(
          k, [this](uint32_t tail, uint32_t, uint32_t) { ++departures_at_[tail]; });
    }
    // The last entry counts the edges that are not departures, which share one place.
    departures_at_.back() = 0;
    for (uint32_t& at : departures_at_) departure_count_ += std::exchange(at, departure_count_);
    departures_ = std::make_unique_for_overwrite<Departure[]>(departure_count_ + 1);
  }

  // Advances departures_at_[v] to the end of the departures at vertex v.
  void WriteDepartures(StopPoll& poll) {
    const auto none = static_cast<uint32_t>(ranking_.points.size());
    const auto write = [this, none](uint32_t tail, uint32_t head, uint32_t next) {
      departures_[departures_at_[tail]] = {head, next};
      departures_at_[tail] += tail != none;
    };
    for (size_t id = 0; id < flags_.size(); ++id) {
      if (poll.Step()) return;
      if (const size_t ahead = id + kAhead; ahead < flags_.size()) {
        for (const uint32_t v : ranks_[ahead]) __builtin_prefetch(&departures_at_[v]);
        for (const uint32_t v : ranks_[ahead - kAhead / 2]) {
          __builtin_prefetch(&departures_[departures_at_[v]]);
        }
      }
      ForEachTriangleDeparture(ranks_[id], write);
    }
    for (size_t k = 0; k + 1 < polygon_starts_.size(); ++k) ForEachPolygonDeparture(k, write);
  }

  const VertexTable& vertices_;
  const Surface& surface_;
  const Ranking& ranking_;
  // By triangle.
  std::vector<uint8_t> flags_;
  // By triangle: the ranks of its corners, the lowest one first. The number of vertices instead if
  // the triangle is free, and, after its facet is known, if it is only a part of it.
  std::unique_ptr<Ranks[]> ranks_;
  size_t triangle_facets_ = 0;
  // The facets that are not triangles of the surface, by ranks, each from its lowest vertex.
  std::vector<uint32_t> polygon_starts_;
  std::vector<uint32_t> polygon_vertices_;
  // Departures in order of their lower vertices, and the start or end of each vertex's range.
  std::unique_ptr<Departure[]> departures_;
  uint32_t departure_count_ = 0;
  std::vector<uint32_t> departures_at_;
};

}  // namespace

Hull SnapshotOfEnds(const VertexTable& vertices, std::span<const VertexId> ends) {
  HULLD_CHECK(ends.size() <= 2);
  std::vector<Vector> points;
  for (const VertexId id : ends) points.push_back(vertices[id]);
  std::vector<Edge> edges;
  if (points.size() == 2) edges.push_back({0, 1});
  const int dimension = static_cast<int>(points.size()) - 1;
  return Hull(dimension, std::move(points), {}, {}, std::move(edges));
}

std::optional<Hull> SnapshotOfPolygon(const VertexTable& vertices, std::span<const VertexId> loop,
                                      StopPoll& poll) {
  HULLD_CHECK(loop.size() >= 3);
  Ranking ranking = Rank(vertices, poll);
  if (poll.stopped()) return std::nullopt;
  const auto n = static_cast<uint32_t>(loop.size());
  std::vector<uint32_t> facet;
  for (const VertexId id : loop) {
    if (poll.Step()) return std::nullopt;
    facet.push_back(ranking.index_of[id]);
  }
  std::rotate(facet.begin(), std::min_element(facet.begin(), facet.end()), facet.end());
  if (facet[1] > facet[n - 1]) std::reverse(facet.begin() + 1, facet.end());
  // The two edges of each vertex lead to its neighbors; each edge is recorded at its lower vertex.
  std::vector<std::pair<uint32_t, uint32_t>> neighbors(n);
  for (uint32_t i = 0; i < n; ++i) {
    if (poll.Step()) return std::nullopt;
    neighbors[facet[i]] = std::minmax(facet[(i + n - 1) % n], facet[(i + 1) % n]);
  }
  std::vector<Edge> edges;
  edges.reserve(n);
  for (uint32_t v = 0; v < n; ++v) {
    if (poll.Step()) return std::nullopt;
    if (neighbors[v].first > v) edges.push_back({v, neighbors[v].first});
    if (neighbors[v].second > v) edges.push_back({v, neighbors[v].second});
  }
  return Hull(2, std::move(ranking.points), {0, n}, std::move(facet), std::move(edges));
}

std::optional<Hull> SnapshotOf(const VertexTable& vertices, const Surface& surface,
                               StopPoll& poll) {
  Ranking ranking = Rank(vertices, poll);
  if (poll.stopped()) return std::nullopt;
  FaceCollector collector(vertices, surface, ranking);
  if (!collector.Run(poll)) return std::nullopt;
  std::optional<Faces> faces = collector.Assemble(poll);
  if (!faces) return std::nullopt;
  return Hull(3, std::move(ranking.points), std::move(faces->facet_starts),
              std::move(faces->facet_vertices), std::move(faces->edges));
}

}  // namespace hulld
