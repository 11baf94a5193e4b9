#include "core/hull/growth/canonical_snapshot.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

// The canonical order of vertices: index_of[id] is the place of vertex `id` in `points`.
struct Ranking {
  std::vector<Vector> points;
  std::vector<uint32_t> index_of;
};

Ranking Rank(const VertexTable& vertices, std::vector<VertexId> ids) {
  std::sort(ids.begin(), ids.end(), [&](VertexId a, VertexId b) {
    const Vector& p = vertices[a];
    const Vector& q = vertices[b];
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  });
  Ranking ranking;
  ranking.points.reserve(ids.size());
  ranking.index_of.resize(vertices.id_bound());
  for (const VertexId id : ids) {
    ranking.index_of[id] = static_cast<uint32_t>(ranking.points.size());
    ranking.points.push_back(vertices[id]);
  }
  return ranking;
}

std::vector<VertexId> VerticesOf(const VertexTable& vertices, const Surface& surface) {
  std::vector<char> used(vertices.id_bound(), 0);
  std::vector<VertexId> ids;
  surface.ForEachTriangle([&](TriangleId, const SurfaceTriangle& t) {
    for (const VertexId v : t.corners) {
      if (!std::exchange(used[v], 1)) ids.push_back(v);
    }
  });
  return ids;
}

// An edge of the surface between two triangles that are not coplanar, with its facet to the left.
struct Boundary {
  uint32_t tail;
  uint32_t head;
};

// Walks over one maximal facet and collects its boundary. is_flat[3 * t + i]: edge i of triangle t
// lies within a facet.
std::vector<Boundary> CollectFacet(const Surface& surface, const Ranking& ranking,
                                   const std::vector<char>& is_flat, TriangleId first,
                                   std::vector<char>& visited) {
  std::vector<Boundary> boundary;
  std::vector<TriangleId> pending = {first};
  visited[first] = 1;
  while (!pending.empty()) {
    const TriangleId id = pending.back();
    pending.pop_back();
    const SurfaceTriangle& t = surface.triangle(id);
    for (int i = 0; i < 3; ++i) {
      if (!is_flat[3 * id + i]) {
        boundary.push_back(
            {ranking.index_of[t.corners[i]], ranking.index_of[t.corners[(i + 1) % 3]]});
      } else if (!std::exchange(visited[t.neighbours[i]], 1)) {
        pending.push_back(t.neighbours[i]);
      }
    }
  }
  return boundary;
}

// The boundary's loop from its lowest vertex. Requires edges that form one loop.
std::vector<uint32_t> LoopOf(std::vector<Boundary> boundary) {
  std::sort(boundary.begin(), boundary.end(),
            [](const Boundary& a, const Boundary& b) { return a.tail < b.tail; });
  HULLD_CHECK(!boundary.empty());
  std::vector<uint32_t> loop;
  loop.reserve(boundary.size());
  uint32_t at = boundary.front().tail;
  do {
    loop.push_back(at);
    const auto edge =
        std::lower_bound(boundary.begin(), boundary.end(), at,
                         [](const Boundary& b, uint32_t tail) { return b.tail < tail; });
    HULLD_CHECK(edge != boundary.end() && edge->tail == at && loop.size() <= boundary.size());
    at = edge->head;
  } while (at != boundary.front().tail);
  return loop;
}

// Incomplete when stopped.
std::vector<char> FlatEdges(const VertexTable& vertices, const Surface& surface, StopPoll& poll) {
  std::vector<char> is_flat(3 * surface.id_bound(), 0);
  surface.ForEachTriangle([&](TriangleId id, const SurfaceTriangle& t) {
    if (poll.Step()) return;
    for (int i = 0; i < 3; ++i) {
      const TriangleId other = t.neighbours[i];
      if (other < id) continue;
      const SurfaceTriangle& o = surface.triangle(other);
      int j = 0;
      while (j < 3 && o.corners[j] != t.corners[(i + 1) % 3]) ++j;
      HULLD_CHECK(j < 3);
      const Vector& opposite = vertices[o.corners[(j + 2) % 3]];
      if (Orient3d(vertices[t.corners[0]], vertices[t.corners[1]], vertices[t.corners[2]],
                   opposite) == 0) {
        is_flat[3 * id + i] = 1;
        is_flat[3 * other + j] = 1;
      }
    }
  });
  return is_flat;
}

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

Hull SnapshotOfPolygon(const VertexTable& vertices, std::span<const VertexId> loop) {
  HULLD_CHECK(loop.size() >= 3);
  Ranking ranking = Rank(vertices, {loop.begin(), loop.end()});
  const auto n = static_cast<uint32_t>(loop.size());
  std::vector<uint32_t> facet;
  for (const VertexId id : loop) facet.push_back(ranking.index_of[id]);
  std::rotate(facet.begin(), std::min_element(facet.begin(), facet.end()), facet.end());
  if (facet[1] > facet[n - 1]) std::reverse(facet.begin() + 1, facet.end());
  std::vector<Edge> edges;
  for (uint32_t i = 0; i < n; ++i) {
    const auto [low, high] = std::minmax(facet[i], facet[(i + 1) % n]);
    edges.push_back({low, high});
  }
  std::sort(edges.begin(), edges.end());
  return Hull(2, std::move(ranking.points), {0, n}, std::move(facet), std::move(edges));
}

std::optional<Hull> SnapshotOf(const VertexTable& vertices, const Surface& surface,
                               StopPoll& poll) {
  const std::vector<char> is_flat = FlatEdges(vertices, surface, poll);
  if (poll.stopped()) return std::nullopt;
  Ranking ranking = Rank(vertices, VerticesOf(vertices, surface));

  std::vector<std::vector<uint32_t>> facets;
  std::vector<char> visited(surface.id_bound(), 0);
  surface.ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) {
    if (poll.Step() || visited[id]) return;
    facets.push_back(LoopOf(CollectFacet(surface, ranking, is_flat, id, visited)));
  });
  if (poll.stopped()) return std::nullopt;
  std::sort(facets.begin(), facets.end());

  size_t corners = 0;
  for (const std::vector<uint32_t>& facet : facets) corners += facet.size();
  // Reserved, as a snapshot stays as it is for long.
  std::vector<uint32_t> starts;
  starts.reserve(facets.size() + 1);
  starts.push_back(0);
  std::vector<uint32_t> facet_vertices;
  facet_vertices.reserve(corners);
  std::vector<Edge> edges;
  edges.reserve(corners / 2);
  for (const std::vector<uint32_t>& facet : facets) {
    facet_vertices.insert(facet_vertices.end(), facet.begin(), facet.end());
    starts.push_back(static_cast<uint32_t>(facet_vertices.size()));
    for (size_t i = 0; i < facet.size(); ++i) {
      const uint32_t tail = facet[i];
      const uint32_t head = facet[(i + 1) % facet.size()];
      if (tail < head) edges.push_back({tail, head});
    }
  }
  std::sort(edges.begin(), edges.end());
  return Hull(3, std::move(ranking.points), std::move(starts), std::move(facet_vertices),
              std::move(edges));
}

}  // namespace hulld
