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

constexpr char kPlySquare[] =
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
    "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n";

TEST(MeshFile, PlyFacesAreRead) {
  const TempFile file("a.ply", std::string("ply\nformat ascii 1.0\n") + kPlySquare +
                                   "0 0 0\n1 0 0\n1 1 0\n0 1 .1\n4 0 1 2 3 2 .5 .5\n3 0 1\n2 0\n");
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->triangles,
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3), ElementsAre(0, 1, 2)));
  EXPECT_THAT(mesh->vertices[3], ElementsAre(0, 1, 0.1));
  for (const SplitBy split : {SplitBy::kName, SplitBy::kComponent}) {
    const auto parts = ReadParts(file.path(), split);
    ASSERT_TRUE(parts.ok()) << parts.status();
    EXPECT_EQ(parts->size(), 1u);
  }
}

TEST(MeshFile, BinaryPlyFacesMayPrecedeTheirVertices) {
  const std::string header =
      "element face 1\nproperty uchar flags\nproperty list uchar ushort vertex_index\n"
      "element vertex 3\nproperty short x\nproperty short y\nproperty short z\nend_header\n";
  const std::string little("\7\3\0\0\1\0\2\0\0\0\0\0\0\0\1\0\0\0\0\0\0\0\2\0\0\0", 26);
  const std::string big("\7\3\0\0\0\1\0\2\0\0\0\0\0\0\0\1\0\0\0\0\0\0\0\2\0\0", 26);
  for (const bool is_big : {false, true}) {
    const TempFile file("a.ply", "ply\nformat binary_" + std::string(is_big ? "big" : "little") +
                                     "_endian 1.0\n" + header + (is_big ? big : little));
    const auto mesh = ReadMesh(file.path());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_THAT(mesh->triangles, ElementsAre(ElementsAre(0, 1, 2)));
    EXPECT_THAT(mesh->vertices,
                ElementsAre(ElementsAre(0, 0, 0), ElementsAre(1, 0, 0), ElementsAre(0, 2, 0)));
  }
}

// Stanford's scans have a single element of all strips.
TEST(MeshFile, PlyStripsAreRead) {
  const TempFile file(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement tristrips 1\n"
      "property list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n9 0 1 2 3 -1 2 1 0 -1\n");
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->triangles,
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(2, 1, 3), ElementsAre(2, 1, 0)));
}

TEST(MeshFile, PlyFacesMustNameVertices) {
  const auto error = [](const std::string& rows) {
    const TempFile file("a.ply", std::string("ply\nformat ascii 1.0\n") + kPlySquare +
                                     "0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + rows);
    return Error(ReadMesh(file.path()));
  };
  EXPECT_THAT(error("3 0 1 2 0\n3 0 1 4 0\n"),
              HasSubstr("a.ply:16: face 1 names vertex 4, but the vertices are 0 to 3"));
  EXPECT_THAT(error("3 0 1 -1 0\n3 0 1 2 0\n"), HasSubstr("a.ply:15: face 0 names vertex -1"));
  EXPECT_THAT(error("3 0 1 1.5 0\n"), HasSubstr("a.ply:15: \"1.5\" is not the index of a vertex"));
  EXPECT_THAT(error("3 0 1 2 0\n"), HasSubstr("is it complete?"));
  const TempFile named("b.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\n"
                       "property int z\nelement face 1\nproperty list uchar float uv\nend_header\n"
                       "0 0 0\n0\n");
  EXPECT_THAT(Error(ReadMesh(named.path())),
              HasSubstr("b.ply:9: the element face has no list vertex_indices"));
}

TEST(MeshFile, PlyCloudsHaveNoTriangles) {
  const TempFile file("a.ply",
                      "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\n"
                      "property int z\nelement face 0\nproperty list uchar int vertex_indices\n"
                      "end_header\nnan 0 0\n");
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(mesh->vertices.empty());
  EXPECT_THAT(ReadParts(file.path(), SplitBy::kName).status().ToString(),
              HasSubstr("a.ply: contains no triangles"));
}

TEST(MeshFile, FormatsWithoutFacesAreRefusedWithAdvice) {
  const TempFile file("a.xyz", "0 0 0\n");
  EXPECT_THAT(
      Error(ReadMesh(file.path())),
      HasSubstr("a.xyz: meshes are read from obj, off, ply, stl, gltf and dae; convert the file"));
}

}  // namespace mesh_file_test
}  // namespace hulld
