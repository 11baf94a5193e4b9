#include "core/hull/surface/surface_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {

// Writes values into a surface that no insertion would.
class SurfaceTestPeer {
 public:
  static SurfaceTriangle& Triangle(Surface& surface, TriangleId id) {
    return surface.triangles_.Mutable(id);
  }
  static void CountOneMore(Surface& surface) { ++surface.alive_; }
};

namespace surface_check_test {

// A hull of points on a sphere, so that vertex i is points[i].
class SurfaceCheck : public testing::Test {
 protected:
  SurfaceCheck() : points_(Points()), surface_(MakeSurface()) {}

  static std::vector<Vector> Points() {
    const uint64_t seed = TestSeed(601);
    Random random(seed);
    return RandomOnSphere(random, 200, 1);
  }

  Surface MakeSurface() {
    for (int i = 0; i < 3; ++i) vertices_.Add(points_[i]);
    Surface surface(vertices_, std::array<VertexId, 3>{0, 1, 2}, vertices_.Add(points_[3]));
    for (size_t i = 4; i < points_.size(); ++i) surface.Insert(vertices_, points_[i]);
    return surface;
  }

  std::vector<TriangleId> All() const {
    std::vector<TriangleId> ids;
    surface_.ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) { ids.push_back(id); });
    return ids;
  }
  SurfaceTriangle& Triangle(TriangleId id) { return SurfaceTestPeer::Triangle(surface_, id); }
  const char* Defect(const VertexTable& vertices) const {
    const char* defect = FindDefect(surface_, vertices, All());
    return defect == nullptr ? "none" : defect;
  }
  const char* Defect() const { return Defect(vertices_); }

  std::vector<Vector> points_;
  VertexTable vertices_;
  Surface surface_;
};

TEST_F(SurfaceCheck, FindsNothingOnASoundSurface) {
  ASSERT_EQ(vertices_.size(), points_.size());
  EXPECT_STREQ(Defect(), "none");
}

TEST_F(SurfaceCheck, FindsNothingWhereFacetsAreCoplanar) {
  const std::vector<Vector> lattice = LatticeCube(4, 0.1);
  Random random(602);
  for (int order = 0; order < 20; ++order) {
    std::vector<Vector> points = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
    std::vector<Vector> rest = lattice;
    Shuffle(random, rest);
    VertexTable vertices;
    for (int i = 0; i < 3; ++i) vertices.Add(points[i]);
    Surface surface(vertices, std::array<VertexId, 3>{0, 1, 2}, vertices.Add(points[3]));
    for (const Vector& p : rest) {
      surface.Insert(vertices, p);
      std::vector<TriangleId> ids;
      surface.ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) { ids.push_back(id); });
      ASSERT_EQ(FindDefect(surface, vertices, ids), nullptr);
    }
    EXPECT_EQ(vertices.size(), 8u);
  }
}

TEST_F(SurfaceCheck, FindsADeadNeighbor) {
  const TriangleId neighbor = Triangle(0).neighbors[1];
  Triangle(neighbor).corners[0] = UINT32_MAX;
  EXPECT_STREQ(FindDefect(surface_, vertices_, std::vector<TriangleId>{0}),
               "a neighbor is not alive");
  EXPECT_STREQ(FindDefect(surface_, vertices_, std::vector<TriangleId>{neighbor}),
               "a triangle is not alive");
}

TEST_F(SurfaceCheck, FindsANeighborThatDoesNotExist) {
  Triangle(0).neighbors[1] = 1'000'000;
  EXPECT_STREQ(Defect(), "a neighbor is not alive");
}

TEST_F(SurfaceCheck, FindsALinkThatIsNotMutual) {
  // The neighbor of a neighbor links to a triangle that is not beyond the edge.
  const TriangleId neighbor = Triangle(0).neighbors[0];
  for (TriangleId& link : Triangle(neighbor).neighbors) {
    if (link == 0) link = neighbor;
  }
  EXPECT_STREQ(FindDefect(surface_, vertices_, std::vector<TriangleId>{0}),
               "a neighbor does not link back");
}

TEST_F(SurfaceCheck, FindsSwappedLinks) {
  std::swap(Triangle(0).neighbors[0], Triangle(0).neighbors[1]);
  EXPECT_STREQ(Defect(), "a neighbor does not traverse the common edge in the opposite direction");
}

TEST_F(SurfaceCheck, FindsATriangleTurnedInsideOut) {
  SurfaceTriangle& t = Triangle(0);
  std::swap(t.corners[0], t.corners[1]);
  EXPECT_STREQ(Defect(), "the center is not inside");
}

TEST_F(SurfaceCheck, FindsADeadVertex) {
  VertexTable without = vertices_;
  without.Remove(Triangle(0).corners[2]);
  // Otherwise the counts reveal it.
  without.Add({9, 9, 9});
  without.Remove(without.Add({8, 8, 8}));
  EXPECT_STREQ(Defect(without), "a rounded plane misses a corner");
  VertexTable fewer = vertices_;
  fewer.Remove(Triangle(0).corners[2]);
  EXPECT_STREQ(Defect(fewer), "F is not 2 V - 4");
  Triangle(0).corners[2] = 1'000'000;
  EXPECT_STREQ(Defect(), "a corner is not a vertex");
}

TEST_F(SurfaceCheck, FindsTrianglesWithoutArea) {
  Triangle(0).corners[2] = Triangle(0).corners[1];
  EXPECT_STREQ(Defect(), "a triangle has no area");
}

TEST_F(SurfaceCheck, FindsAnInaccuratePlane) {
  Triangle(0).offset *= 1 + 0x1p-40;
  EXPECT_STREQ(Defect(), "a rounded plane misses a corner");
}

TEST_F(SurfaceCheck, FindsWrongCounts) {
  SurfaceTestPeer::CountOneMore(surface_);
  EXPECT_STREQ(Defect(), "IDs are neither alive nor free");
}

// Flips the diagonal of two neighbors: all links are correct, but the edge is concave.
TEST_F(SurfaceCheck, FindsADent) {
  const TriangleId f = 0;
  const TriangleId g = Triangle(f).neighbors[0];
  const std::array<VertexId, 3> abc = Triangle(f).corners;
  const std::array<TriangleId, 3> of_f = Triangle(f).neighbors;
  std::array<VertexId, 3> bad = Triangle(g).corners;
  std::array<TriangleId, 3> of_g = Triangle(g).neighbors;
  while (bad[0] != abc[1]) {
    std::rotate(bad.begin(), bad.begin() + 1, bad.end());
    std::rotate(of_g.begin(), of_g.begin() + 1, of_g.end());
  }
  const VertexId d = bad[2];
  // a b c and b a d become d c a and c d b; the planes stay with their triangles.
  const auto relink = [&](TriangleId at, TriangleId from, TriangleId to) {
    for (TriangleId& link : Triangle(at).neighbors) {
      if (link == from) link = to;
    }
  };
  VertexTable other;
  for (const Vector& p : points_) other.Add(p);
  Triangle(f).corners = {d, abc[2], abc[0]};
  Triangle(f).neighbors = {g, of_f[2], of_g[1]};
  Triangle(g).corners = {abc[2], d, abc[1]};
  Triangle(g).neighbors = {f, of_g[2], of_f[1]};
  relink(of_g[1], g, f);
  relink(of_f[1], f, g);
  for (const TriangleId id : {f, g}) {
    SurfaceTriangle& t = Triangle(id);
    const Vector& a = points_[t.corners[0]];
    t.normal = Cross(points_[t.corners[1]] - a, points_[t.corners[2]] - a);
    t.offset = t.normal.dot(a);
    t.slope = 1;
  }
  EXPECT_STREQ(Defect(other), "the surface is not convex at an edge");
}

TEST_F(SurfaceCheck, FindsAStarWithoutItsApex) {
  const VertexId last = static_cast<VertexId>(points_.size() - 1);
  std::vector<TriangleId> star;
  surface_.ForEachTriangle([&](TriangleId id, const SurfaceTriangle& t) {
    if (t.corners[2] == last) star.push_back(id);
  });
  ASSERT_GE(star.size(), 3u);
  EXPECT_EQ(FindStarDefect(surface_, vertices_, star, last), nullptr);
  EXPECT_STREQ(FindStarDefect(surface_, vertices_, star, 0),
               "a new triangle does not end at the new vertex");
  std::swap(star[0], star[1]);
  EXPECT_EQ(FindStarDefect(surface_, vertices_, star, last), nullptr);
  star.pop_back();
  EXPECT_STREQ(FindStarDefect(surface_, vertices_, star, last), "the new triangles form no ring");
}

#ifndef NDEBUG
TEST_F(SurfaceCheck, AbortsAtTheInsertionThatBreaksTheSurface) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  SurfaceTestPeer::CountOneMore(surface_);
  EXPECT_DEATH(surface_.Insert(vertices_, Vector(2, 0, 0)),
               "check failed: IDs are neither alive nor free");
}
#endif

}  // namespace surface_check_test
}  // namespace hulld
