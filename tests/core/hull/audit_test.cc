#include "core/hull/audit.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace audit_test {

// The parts of a snapshot, to be broken individually.
struct Parts {
  int dimension;
  std::vector<Vector> vertices;
  std::vector<std::vector<uint32_t>> facets;
  std::vector<Edge> edges;

  Hull Assemble() const {
    std::vector<uint32_t> starts = {0};
    std::vector<uint32_t> flat;
    for (const std::vector<uint32_t>& facet : facets) {
      flat.insert(flat.end(), facet.begin(), facet.end());
      starts.push_back(static_cast<uint32_t>(flat.size()));
    }
    return Hull(dimension, vertices, starts, flat, edges);
  }
};

// Vertex 4x + 2y + z.
Parts Cube() {
  return {3,
          LatticeCube(2, 1),
          {{0, 1, 3, 2}, {0, 2, 6, 4}, {0, 4, 5, 1}, {1, 5, 7, 3}, {2, 3, 7, 6}, {4, 6, 7, 5}},
          {{0, 1},
           {0, 2},
           {0, 4},
           {1, 3},
           {1, 5},
           {2, 3},
           {2, 6},
           {3, 7},
           {4, 5},
           {4, 6},
           {5, 7},
           {6, 7}}};
}

void ExpectFound(const Parts& parts, const char* what) {
  const absl::Status status = AuditHull(parts.Assemble());
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << what;
}

// Returns the audit of `hull` if should_stop is first true at poll number `last`; 0: never.
absl::Status AuditUntil(const Hull& hull, int last, int* polls) {
  *polls = 0;
  return AuditHull(hull, [last, polls] { return ++*polls == last; });
}

TEST(Audit, StopsAtEveryPoll) {
  Random random(41);
  const Hull solid = BuildHull(RandomOnSphere(random, 4000, 2));
  std::vector<Vector> circle;
  for (int i = -3000; i <= 3000; ++i) circle.emplace_back(i, i * i, 0);
  for (const Hull& hull : {solid, BuildHull(circle)}) {
    int polls = 0;
    EXPECT_TRUE(AuditUntil(hull, 0, &polls).ok());
    // Every vertex and every corner of a facet takes at least one step.
    size_t steps = hull.vertices().size();
    for (size_t f = 0; f < hull.facet_count(); ++f) steps += hull.facet(f).size();
    EXPECT_GE(static_cast<size_t>(polls), steps / 1024);
    const int all = polls;
    for (int last = 1; last <= all; last += 1 + all / 16) {
      const absl::Status status = AuditUntil(hull, last, &polls);
      EXPECT_EQ(status.code(), absl::StatusCode::kCancelled) << status;
      // After a stop, it does not poll again.
      EXPECT_EQ(polls, last);
    }
  }
}

TEST(Audit, PassesTheUnitCube) {
  const absl::Status status = AuditHull(Cube().Assemble());
  EXPECT_TRUE(status.ok()) << status;
}

TEST(Audit, FindsBrokenVertices) {
  Parts parts = Cube();
  parts.vertices[7].x() = std::numeric_limits<double>::quiet_NaN();
  ExpectFound(parts, "NaN");
  parts = Cube();
  parts.vertices[0].x() = -0.0;
  ExpectFound(parts, "negative zero");
  parts = Cube();
  std::swap(parts.vertices[3], parts.vertices[4]);
  ExpectFound(parts, "vertices out of order");
  parts = Cube();
  parts.vertices.emplace_back(2, 2, 2);
  ExpectFound(parts, "a vertex that no facet uses");
  parts = Cube();
  parts.vertices[7] = Vector(1, 1, 1.0000000000000002);
  ExpectFound(parts, "facets that are not planar");
  parts = Cube();
  parts.dimension = 2;
  ExpectFound(parts, "wrong dimension");
}

TEST(Audit, FindsBrokenFacets) {
  Parts parts = Cube();
  parts.facets.pop_back();
  ExpectFound(parts, "a missing facet");
  parts = Cube();
  parts.facets[0] = {0, 2, 3, 1};
  ExpectFound(parts, "a facet the wrong way round");
  parts = Cube();
  for (std::vector<uint32_t>& facet : parts.facets) {
    std::reverse(facet.begin() + 1, facet.end());
  }
  std::sort(parts.facets.begin(), parts.facets.end());
  ExpectFound(parts, "all facets the wrong way round");
  parts = Cube();
  std::swap(parts.facets[0], parts.facets[1]);
  ExpectFound(parts, "facets out of order");
  parts = Cube();
  parts.facets[0] = {1, 3, 2, 0};
  ExpectFound(parts, "a facet that does not start at its lowest vertex");
  parts = Cube();
  parts.facets[0] = {0, 1, 3};
  parts.facets.insert(parts.facets.begin() + 1, {0, 3, 2});
  parts.edges.insert(parts.edges.begin() + 2, {0, 3});
  ExpectFound(parts, "a facet in two coplanar pieces");
}

TEST(Audit, FindsBrokenEdges) {
  Parts parts = Cube();
  parts.edges.pop_back();
  ExpectFound(parts, "a missing edge");
  parts = Cube();
  parts.edges[0] = {0, 7};
  ExpectFound(parts, "a diagonal as an edge");
  parts = Cube();
  std::swap(parts.edges[0], parts.edges[1]);
  ExpectFound(parts, "edges out of order");
}

// A closed manifold with V - E + F = 2 that is not convex: an apex pushed in.
TEST(Audit, FindsDents) {
  Parts parts = Cube();
  parts.vertices[0] = Vector(0, 0, 0);
  // The square (0, 1, 3, 2) with an inner apex at x = 0.25 becomes four triangles.
  parts.vertices.insert(parts.vertices.begin() + 4, Vector(0.25, 0.5, 0.5));
  const auto moved = [](uint32_t v) { return v >= 4 ? v + 1 : v; };
  for (std::vector<uint32_t>& facet : parts.facets) {
    for (uint32_t& v : facet) v = moved(v);
  }
  for (Edge& edge : parts.edges) edge = {moved(edge.tail), moved(edge.head)};
  parts.facets.erase(parts.facets.begin());
  for (std::vector<uint32_t> triangle :
       std::vector<std::vector<uint32_t>>{{0, 1, 4}, {1, 3, 4}, {2, 4, 3}, {0, 4, 2}}) {
    parts.facets.push_back(triangle);
  }
  std::sort(parts.facets.begin(), parts.facets.end());
  for (uint32_t v = 0; v < 4; ++v) parts.edges.push_back({v, 4});
  std::sort(parts.edges.begin(), parts.edges.end());
  ExpectFound(parts, "a dent");
}

// Locally convex everywhere, closed, and wound twice about its axis: only the global check detects
// it.
TEST(Audit, FindsAPyramidOverAPentagram) {
  Parts parts;
  parts.dimension = 3;
  // An integer pentagon in convex position, counter-clockwise from above in the order 0 1 2 3 4.
  const std::vector<Vector> ring = {{10, 0, 0}, {3, 9, 0}, {-8, 6, 0}, {-8, -6, 0}, {3, -9, 0}};
  parts.vertices = ring;
  parts.vertices.emplace_back(0, 0, 10);
  parts.vertices.emplace_back(0, 0, -10);
  std::vector<uint32_t> order(7);
  std::vector<uint32_t> rank(7);
  for (uint32_t i = 0; i < 7; ++i) order[i] = i;
  const auto less = [&](uint32_t i, uint32_t j) {
    const Vector& p = parts.vertices[i];
    const Vector& q = parts.vertices[j];
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  };
  std::sort(order.begin(), order.end(), less);
  std::vector<Vector> sorted;
  for (uint32_t i = 0; i < 7; ++i) {
    rank[order[i]] = i;
    sorted.push_back(parts.vertices[order[i]]);
  }
  parts.vertices = sorted;
  const auto add = [&](uint32_t i, uint32_t j, uint32_t k) {
    std::vector<uint32_t> facet = {rank[i], rank[j], rank[k]};
    std::rotate(facet.begin(), std::min_element(facet.begin(), facet.end()), facet.end());
    parts.facets.push_back(facet);
  };
  const auto link = [&](uint32_t i, uint32_t j) {
    parts.edges.push_back({std::min(rank[i], rank[j]), std::max(rank[i], rank[j])});
  };
  for (uint32_t i = 0; i < 5; ++i) {
    const uint32_t j = (i + 2) % 5;  // the star winds around twice
    add(i, j, 5);
    add(j, i, 6);
    link(i, j);
    link(i, 5);
    link(i, 6);
  }
  std::sort(parts.facets.begin(), parts.facets.end());
  std::sort(parts.edges.begin(), parts.edges.end());
  ExpectFound(parts, "a surface wound twice");
}

TEST(Audit, FindsBrokenFlatHulls) {
  Parts square = {2, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}}, {{0, 1, 3, 2}}, {}};
  square.edges = {{0, 1}, {0, 2}, {1, 3}, {2, 3}};
  EXPECT_TRUE(AuditHull(square.Assemble()).ok()) << AuditHull(square.Assemble());
  Parts parts = square;
  parts.facets = {{0, 2, 3, 1}};
  ExpectFound(parts, "a polygon that starts the other way");
  parts = square;
  parts.facets = {{0, 1, 2, 3}};
  ExpectFound(parts, "a polygon that crosses itself");
  parts = square;
  parts.vertices[3].z() = 1e-300;
  ExpectFound(parts, "a polygon that is not planar");
  parts = square;
  parts.vertices[3] = Vector(0.5, 0.5, 0);
  parts.vertices = {{0, 0, 0}, {0, 1, 0}, {0.5, 0.5, 0}, {1, 0, 0}};
  parts.facets = {{0, 1, 2, 3}};
  parts.edges = {{0, 1}, {0, 3}, {1, 2}, {2, 3}};
  ExpectFound(parts, "a vertex inside an edge");
  ExpectFound({1, {{0, 0, 0}, {0, 0, 0}}, {}, {{0, 1}}}, "a segment between equal points");
  ExpectFound({0, {{0, 0, 0}, {0, 0, 1}}, {}, {}}, "a point with two vertices");
  ExpectFound({-1, {{0, 0, 0}}, {}, {}}, "an empty hull with a vertex");
  EXPECT_TRUE(AuditHull(Parts{1, {{0, 0, 0}, {0, 0, 1}}, {}, {{0, 1}}}.Assemble()).ok());
}

TEST(AuditContainment, NamesThePointOutside) {
  const Hull hull = BuildHull(LatticeCube(2, 1));
  std::vector<Vector> points = LatticeCube(3, 0.5);
  EXPECT_TRUE(AuditContainment(hull, points).ok());
  points[13].x() = std::nextafter(1.0, 2.0);
  const absl::Status status = AuditContainment(hull, points);
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_NE(std::string(status.message()).find("13"), std::string::npos) << status;
}

// A normal of 2^63 times such differences exceeds the largest double, so the filter must leave
// these to integers: one product is -infinity, which would put the point far below the facet.
TEST(AuditContainment, NamesThePointOutsideWhereProductsOverflow) {
  constexpr double kSize = 0x1p965;
  const std::vector<Vector> corners = {Vector(-1.5, 2.5, -1) * kSize, Vector(-1, -1, 2) * kSize,
                                       Vector(2, -1, -1) * kSize, Vector(-1.5, -1, -1) * kSize};
  const Hull hull = BuildHull(corners);
  const std::vector<Vector> inside = {corners[0] + Vector(0.7, -1.5, 0.7) * 0x1p962};
  EXPECT_TRUE(AuditContainment(hull, inside).ok());
  // Above the plane x + y + z = 0 of the first three.
  const std::vector<Vector> outside = {corners[0] + Vector(0.7, -1.35, 0.7) * 0x1p962};
  EXPECT_FALSE(AuditContainment(hull, outside).ok());
}

TEST(AuditContainment, IsExactForFlatHulls) {
  const std::vector<Vector> segment = {{0, 0, 0}, {3, 3, 3}};
  const Hull hull = BuildHull(segment);
  const std::vector<Vector> on = {{1, 1, 1}, {3, 3, 3}};
  EXPECT_TRUE(AuditContainment(hull, on).ok());
  const std::vector<Vector> off = {{1, 1, std::nextafter(1.0, 2.0)}};
  EXPECT_FALSE(AuditContainment(hull, off).ok());
  const std::vector<Vector> beyond = {{4, 4, 4}};
  EXPECT_FALSE(AuditContainment(hull, beyond).ok());
  EXPECT_FALSE(AuditContainment(Hull(), on).ok());
  EXPECT_TRUE(AuditContainment(Hull(), {}).ok());
  const std::vector<Vector> point = {{1, 1, 1}};
  EXPECT_TRUE(AuditContainment(BuildHull(point), point).ok());
  EXPECT_FALSE(AuditContainment(BuildHull(point), off).ok());
}

}  // namespace audit_test
}  // namespace hulld
