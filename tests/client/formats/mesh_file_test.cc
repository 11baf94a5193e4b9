#include "client/formats/mesh_file.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace mesh_file_test {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::ElementsAreArray;
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
  EXPECT_THAT(Error(ReadMesh(file.path())), HasSubstr("convert it to obj, off, stl, gltf or dae"));
}

// A triangle in centimeters with Z up; its node moves it by 1 m.
constexpr char kCollada[] = R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="plate-mesh" name="plate"><mesh>
    <source id="at"><float_array id="numbers" count="9">0 0 0 200 0 0 0 0 50</float_array>
      <technique_common><accessor source="#numbers" count="3" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="corners"><input semantic="POSITION" source="#at"/></vertices>
    <triangles count="1"><input semantic="VERTEX" source="#corners" offset="0"/>
      <p>0 1 2</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="scene">
    <node id="plate"><translate>100 0 0</translate><instance_geometry url="#plate-mesh"/></node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
)";

TEST(MeshFile, ColladaIsConvertedToMetersAndKeepsItsAxes) {
  const TempFile file("plate.dae", kCollada);
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const auto near = [](double x, double y, double z) {
    return ElementsAre(DoubleNear(x, 1e-6), DoubleNear(y, 1e-6), DoubleNear(z, 1e-6));
  };
  EXPECT_THAT(mesh->vertices, ElementsAre(near(1, 0, 0), near(3, 0, 0), near(1, 0, 0.5)));
  EXPECT_EQ(mesh->triangles.size(), 1u);
  const PointsRead points = ReadFile(file.path(), PointFormat::kDae);
  EXPECT_TRUE(points.status.ok()) << points.status;
  EXPECT_THAT(points.xyz(), ElementsAreArray([&] {
                std::vector<double> all;
                for (const auto& p : mesh->vertices) all.insert(all.end(), p.begin(), p.end());
                return all;
              }()));
  const auto parts = ReadParts(file.path(), SplitBy::kName);
  ASSERT_TRUE(parts.ok()) << parts.status();
  ASSERT_EQ(parts->size(), 1u);
  EXPECT_EQ((*parts)[0].name, "plate");
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// 3 inches are the double nearest to 0.0762, not 3 times a rounded factor.
TEST(MeshFile, ColladaUnitsAreRoundedOnce) {
  for (const auto& [unit, length] : {std::pair("0.0254", 0.0762), std::pair("0.3048", 0.9144),
                                     std::pair("0.001", 0.003), std::pair("1e-6", 3e-6)}) {
    std::string text = Replaced(kCollada, "meter=\"0.01\"", absl::StrCat("meter=\"", unit, "\""));
    text = Replaced(text, "<translate>100 0 0</translate>", "<translate>1 0 0</translate>");
    text = Replaced(text, "0 0 0 200", "0 0 0 2");
    const TempFile file("plate.dae", text);
    const PointsRead read = ReadFile(file.path(), PointFormat::kDae);
    ASSERT_TRUE(read.status.ok()) << read.status;
    EXPECT_EQ(read.xyz()[3], length) << unit;
  }
}

// assimp would draw the nodes.
TEST(MeshFile, ColladaWithoutMeshesHasNoPoints) {
  const TempFile file("plate.dae", Replaced(kCollada, "<instance_geometry url=\"#plate-mesh\"/>",
                                            "<node><translate>0 7 0</translate></node>"));
  EXPECT_THAT(ReadFile(file.path(), PointFormat::kDae).error(), HasSubstr("contains no vertex"));
  EXPECT_FALSE(ReadParts(file.path(), SplitBy::kName).ok());
}

}  // namespace mesh_file_test
}  // namespace hulld
