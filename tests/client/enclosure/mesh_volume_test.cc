#include "client/enclosure/mesh_volume.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/client/enclosure/box_mesh.h"

namespace hulld {
namespace mesh_volume_test {

TEST(MeshVolume, ABoxFillsItsHull) {
  EXPECT_EQ(VolumeRatio(BoxHull({0, 0, 0}, {0.1, 0.2, 0.3}), BoxMesh({0, 0, 0}, {0.1, 0.2, 0.3})),
            1);
}

TEST(MeshVolume, RatioIsRoundedOnce) {
  EXPECT_EQ(VolumeRatio(BoxHull({-1, -1, -1}, {2, 2, 2}), BoxMesh({5, 5, 5}, {6, 6, 6})), 27);
  EXPECT_EQ(VolumeRatio(BoxHull({0, 0, 0}, {1, 1, 1}), BoxMesh({0, 0, 0}, {3, 1, 1})), 1.0 / 3);
}

TEST(MeshVolume, DirectionDoesNotMatter) {
  TriangleMesh mesh = BoxMesh({0, 0, 0}, {1, 1, 1});
  for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(VolumeRatio(BoxHull({0, 0, 0}, {2, 1, 1}), mesh), 2);
}

// Formats such as STL store separate corners for each triangle.
TEST(MeshVolume, VerticesAtTheSamePositionAreOne) {
  const TriangleMesh box = BoxMesh({0, 0, 0}, {1, 1, 1});
  TriangleMesh soup;
  for (const auto& triangle : box.triangles) {
    const auto first = static_cast<uint32_t>(soup.vertices.size());
    for (const uint32_t corner : triangle) soup.vertices.push_back(box.vertices[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  soup.vertices[0][0] = -0.0;
  EXPECT_TRUE(IsClosed(soup));
}

TEST(MeshVolume, AnOpenMeshHasNoVolume) {
  TriangleMesh mesh = BoxMesh({0, 0, 0}, {1, 1, 1});
  mesh.triangles.pop_back();
  EXPECT_FALSE(IsClosed(mesh));
  EXPECT_EQ(VolumeRatio(BoxHull({0, 0, 0}, {1, 1, 1}), mesh), std::nullopt);
  // One triangle with the wrong orientation.
  mesh = BoxMesh({0, 0, 0}, {1, 1, 1});
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_FALSE(IsClosed(mesh));
  EXPECT_FALSE(IsClosed(TriangleMesh()));
  // A closed sheet without thickness.
  const TriangleMesh sheet = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  EXPECT_TRUE(IsClosed(sheet));
  EXPECT_EQ(VolumeRatio(BoxHull({0, 0, 0}, {1, 1, 1}), sheet), std::nullopt);
}

}  // namespace mesh_volume_test
}  // namespace hulld
