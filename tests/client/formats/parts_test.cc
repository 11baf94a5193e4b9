// Meshes in parts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/mesh_file.h"
#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace parts_test {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> NamesOf(const absl::StatusOr<std::vector<MeshPart>>& parts) {
  EXPECT_TRUE(parts.ok()) << parts.status();
  std::vector<std::string> names;
  for (const MeshPart& part : *parts) names.push_back(part.name);
  return names;
}

constexpr char kObj[] =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 9 9 9\n"
    "f 1 2 3\no chair\nf 4 5 6\ng leg\nf 1 2 3\no table\nf 1 3 4\no chair\nf 4 6 5\no empty\n";

TEST(MeshParts, ObjectsAndGroupsAreParts) {
  const TempFile file("a.obj", kObj);
  const auto parts = ReadParts(file.path(), SplitBy::kName);
  EXPECT_THAT(NamesOf(parts), ElementsAre("", "chair", "chair.leg", "table"));
  const TriangleMesh& chair = (*parts)[1].mesh;
  EXPECT_THAT(chair.vertices,
              ElementsAre(ElementsAre(5, 0, 0), ElementsAre(6, 0, 0), ElementsAre(5, 1, 0)));
  EXPECT_THAT(chair.triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 1)));
}

TEST(MeshParts, ComponentsAreConnectedAtEqualCoordinates) {
  // The third triangle has separate copies of the first one's vertices.
  const TempFile file("a.obj",
                      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 1 0 0\nv 2 0 0\n"
                      "v 1 1 0\nf 1 2 3\nf 4 5 6\nf 7 8 9\n");
  const auto parts = ReadParts(file.path(), SplitBy::kComponent);
  EXPECT_THAT(NamesOf(parts), ElementsAre("component-1", "component-2"));
  EXPECT_EQ((*parts)[0].mesh.triangles.size(), 2u);
  EXPECT_EQ((*parts)[1].mesh.triangles.size(), 1u);
}

TEST(MeshParts, SolidsOfStlAreParts) {
  const auto solid = [](const std::string& name, const std::string& x) {
    return "solid " + name + "\nfacet normal 0 0 1\nouter loop\nvertex " + x + " 0 0\nvertex " + x +
           " 1 0\nvertex " + x + " 0 1\nendloop\nendfacet\nendsolid " + name + "\n";
  };
  const TempFile file("a.stl", solid("left", "0") + solid("right", "7"));
  const auto parts = ReadParts(file.path(), SplitBy::kName);
  EXPECT_THAT(NamesOf(parts), ElementsAre("left", "right"));
  EXPECT_EQ((*parts)[1].mesh.vertices[0][0], 7);
}

TEST(MeshParts, AFileWithoutTrianglesIsRefused) {
  const TempFile file("a.obj", "v 0 0 0\n");
  for (const SplitBy split : {SplitBy::kName, SplitBy::kComponent}) {
    EXPECT_THAT(ReadParts(file.path(), split).status().ToString(),
                HasSubstr("contains no triangles"));
  }
  const TempFile points("a.xyz", "0 0 0\n");
  EXPECT_FALSE(ReadParts(points.path(), SplitBy::kName).ok());
}

}  // namespace parts_test
}  // namespace hulld
