#include "client/formats/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace mesh_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

std::string Error(const absl::StatusOr<TriangleMesh>& mesh) {
  return std::string(mesh.status().message().data(), mesh.status().message().size());
}

TEST(MeshFile, ObjPolygonsBecomeFans) {
  const TempFile file("a.obj",
                      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2//2 3/3/3 4\nf -4 -3 -2\n");
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices.size(), 4u);
  EXPECT_THAT(mesh->triangles,
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3), ElementsAre(0, 1, 2)));
}

TEST(MeshFile, ObjCornersMustNameVertices) {
  for (const char* corner : {"0", "-4", "x", "99999999999999999999", "-9223372036854775808"}) {
    const TempFile file("a.obj", std::string("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 ") + corner + "\n");
    EXPECT_THAT(Error(ReadMesh(file.path())), HasSubstr(":4: \"")) << corner;
  }
}

TEST(MeshFile, ObjFacesMayPrecedeTheirVertices) {
  const TempFile file("a.obj",
                      "# C:\\a\\\nf 1 2 \\\n3 # c\nv 0 0 0 1\nv 1 0 0 .5 .5 .5\nv 1 \\ \n 1 0\r\n");
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->triangles, ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_EQ(mesh->vertices[2][1], 1);
  const auto parts = ReadParts(file.path(), SplitBy::kName);
  ASSERT_TRUE(parts.ok()) << parts.status();
  EXPECT_EQ(parts->size(), 1u);
  const TempFile missing("b.obj", "f 1 2 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\n");
  EXPECT_THAT(Error(ReadMesh(missing.path())),
              HasSubstr(":1: a face names vertex 4, but the file has 3"));
  const TempFile cut("c.obj", "v 0 0 0\nv 1 0 0\\");
  EXPECT_THAT(Error(ReadMesh(cut.path())), HasSubstr("is it complete?"));
}

TEST(MeshFile, ObjFacesMustHaveCorners) {
  const TempFile file("a.obj", "v 0 0 0\nf\n");
  EXPECT_THAT(Error(ReadMesh(file.path())), HasSubstr(":2: a face names no vertex"));
}

TEST(MeshFile, OffFacesAreRead) {
  const TempFile file("a.off",
                      "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2 9 9 9\n");
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->triangles,
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3), ElementsAre(0, 1, 2)));
}

TEST(MeshFile, OffFacesMustNameVertices) {
  const TempFile file("a.off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n");
  EXPECT_THAT(Error(ReadMesh(file.path())), HasSubstr(":4: a face needs"));
  const TempFile huge("b.off", "OFF\n1 1 0\n0 0 0\n18446744073709551615 0 0 0\n");
  EXPECT_THAT(Error(ReadMesh(huge.path())), HasSubstr(":4: a face needs"));
}

TEST(MeshFile, StlIsReadAsTriangles) {
  const TempFile file("a.stl",
                      "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                      "vertex 0 2 0\nendloop\nendfacet\nendsolid s\n");
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->triangles, ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_THAT(mesh->vertices[2], ElementsAre(0, 2, 0));
}

TEST(MeshFile, FormatsWithoutFacesAreRefusedWithAdvice) {
  const TempFile file("a.xyz", "0 0 0\n");
  EXPECT_THAT(
      Error(ReadMesh(file.path())),
      HasSubstr("a.xyz: meshes are read from obj, off, stl, gltf and dae; convert the file"));
}

}  // namespace mesh_file_test
}  // namespace hulld
