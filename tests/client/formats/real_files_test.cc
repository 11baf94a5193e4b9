// Third-party files: the models of Debian's package assimp-testmodels, and the scans in HULLD_DATA
// (default: shared/data next to the project). Skipped with a message if not installed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>

#include "client/formats/mesh_file.h"
#include "tests/client/formats/point_reading.h"
#include "tests/source_tree.h"

namespace hulld {
namespace real_files_test {

namespace fs = std::filesystem;

using testing::ElementsAre;
using testing::HasSubstr;

fs::path Models() { return "/usr/share/assimp/models"; }

#define SKIP_WITHOUT(path) \
  if (!fs::exists(path)) GTEST_SKIP() << "skipped: no data at " << (path)

PointsRead ReadPath(const fs::path& path) {
  return ReadFile(path.string(), *PointFormatOfPath(path.string()));
}

// Returns the points of the lines that start with "v ", by code independent of the reader.
std::vector<double> ObjPointsByStream(const fs::path& path) {
  std::ifstream file(path);
  std::vector<double> xyz;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("v ", 0) != 0) continue;
    const char* at = line.c_str() + 2;
    for (int i = 0; i < 3; ++i) {
      char* end = nullptr;
      xyz.push_back(std::strtod(at, &end));
      at = end;
    }
  }
  return xyz;
}

void ExpectObjRead(const fs::path& path, size_t points) {
  const PointsRead read = ReadPath(path);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_EQ(read.counts.points, points) << path;
  EXPECT_EQ(read.xyz(), ObjPointsByStream(path)) << path;
}

TEST(RealFiles, ObjModelsOfAssimp) {
  SKIP_WITHOUT(Models());
  ExpectObjRead(Models() / "OBJ/spider.obj", 762);
  ExpectObjRead(Models() / "OBJ/box.obj", 8);
  ExpectObjRead(Models() / "OBJ/cube_with_vertexcolors.obj", 8);
  ExpectObjRead(Models() / "OBJ/regr01.obj",
                ObjPointsByStream(Models() / "OBJ/regr01.obj").size() / 3);
  const PointsRead wuson = ReadPath(Models() / "OBJ/WusonOBJ.obj");
  ASSERT_TRUE(wuson.status.ok()) << wuson.status;
  EXPECT_GT(wuson.counts.points, 1500u);
}

TEST(RealFiles, OddObjModelsOfAssimp) {
  SKIP_WITHOUT(Models());
  EXPECT_THAT(ReadPath(Models() / "OBJ/multiple_spaces.obj").xyz(),
              ElementsAre(1, 2, 3, 2, 3, 1, 3, 1, 2, 1, 2, 3));
  EXPECT_EQ(ReadPath(Models() / "OBJ/point_cloud.obj").counts.points, 3u);
  EXPECT_EQ(ReadPath(Models() / "OBJ/box_without_lineending.obj").counts.points, 8u);
  EXPECT_THAT(ReadPath(Models() / "OBJ/number_formats.obj").error(),
              HasSubstr("number_formats.obj:11: \"3.1+e2\" is not a number"));
  EXPECT_THAT(ReadPath(Models() / "OBJ/box_UTF16BE.obj").error(), HasSubstr("iconv"));
}

TEST(RealFiles, PlyMeshesOfAssimp) {
  SKIP_WITHOUT(Models());
  for (const auto& [name, triangles] :
       {std::pair("Wuson.ply", 3732u), std::pair("cube.ply", 12u),
        std::pair("cube_binary.ply", 12u), std::pair("points.ply", 0u)}) {
    const auto mesh = ReadMesh((Models() / "PLY" / name).string());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->triangles.size(), triangles) << name;
  }
}

TEST(RealFiles, OffModelsOfAssimp) {
  SKIP_WITHOUT(Models());
  EXPECT_EQ(ReadPath(Models() / "OFF/Cube.off").counts.points, 8u);
  EXPECT_EQ(ReadPath(Models() / "OFF/Wuson.off").counts.points, 3205u);
  EXPECT_FALSE(ReadPath(Models() / "invalid/OutOfMemory.off").status.ok());
  EXPECT_FALSE(ReadPath(Models() / "invalid/empty.off").status.ok());
}

TEST(RealFiles, PlyModelsOfAssimp) {
  SKIP_WITHOUT(Models());
  EXPECT_EQ(ReadPath(Models() / "PLY/Wuson.ply").counts.points, 11184u);
  EXPECT_EQ(ReadPath(Models() / "PLY/cube.ply").counts.points, 8u);
  EXPECT_EQ(ReadPath(Models() / "PLY/float-color.ply").counts.points, 3u);
  const PointsRead binary = ReadPath(Models() / "PLY/cube_binary.ply");
  EXPECT_EQ(binary.counts.points, 8u);
  EXPECT_TRUE(binary.all_float());
  // Bytes are missing from its middle, so that noise is read before it ends early.
  ReadOptions options;
  options.skip_nonfinite = true;
  const PointsRead cut =
      ReadFile((Models() / "PLY/pond.0.ply").string(), PointFormat::kPly, options);
  EXPECT_THAT(cut.error(), HasSubstr("within the element vertex"));
}

// Every face is three corners, none joined, none lost; text and binary contain the same spider.
TEST(RealFiles, StlModelsOfAssimp) {
  SKIP_WITHOUT(Models());
  const PointsRead binary = ReadPath(Models() / "STL/Spider_binary.stl");
  ASSERT_TRUE(binary.status.ok()) << binary.status;
  EXPECT_TRUE(binary.all_float());
  EXPECT_EQ(binary.counts.points,
            3 * (fs::file_size(Models() / "STL/Spider_binary.stl") - 84) / 50);
  const PointsRead text = ReadPath(Models() / "STL/Spider_ascii.stl");
  ASSERT_TRUE(text.status.ok()) << text.status;
  EXPECT_EQ(text.counts.points, binary.counts.points);
  EXPECT_EQ(ReadPath(Models() / "STL/triangle_with_two_solids.stl").counts.points, 6u);
}

// The box of the file is 1 wide in its own frame; its node rotates it by a quarter turn about x.
TEST(RealFiles, GltfNodesMoveTheirMeshes) {
  SKIP_WITHOUT(Models());
  const fs::path path = Models() / "glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb";
  SKIP_WITHOUT(path);
  const PointsRead read = ReadPath(path);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_GT(read.counts.points, 10000u);
  EXPECT_FALSE(read.all_float());
  const PointsRead box = ReadPath(Models() / "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb");
  ASSERT_TRUE(box.status.ok()) << box.status;
  EXPECT_EQ(box.counts.points, 24u);
  for (const double coordinate : box.xyz()) EXPECT_EQ(std::abs(coordinate), 0.5);
}

// The counts are those of the accessors of POSITION, by a script that is not part of the project.
TEST(RealFiles, ColladaModelsOfAssimp) {
  SKIP_WITHOUT(Models());
  const std::pair<const char*, size_t> sizes[] = {
      {"COLLADA.dae", 3370},
      {"Cinema4D.dae", 707},
      {"ConcavePolygon.dae", 64},
      {"anims_with_full_rotations_between_keys.DAE", 1536},
      {"cube_UTF8BOM.dae", 8},
      {"cube_emptyTags.dae", 8},
      {"cube_tristrips.dae", 24},
      {"cube_xmlspecialchars.dae", 8},
      {"duck.dae", 2108},
      {"kwxport_test_vcolors.dae", 8},
      {"regr01.dae", 236},
      {"sphere_triangulate.dae", 382},
      {"teapot_instancenodes.DAE", 1060}};
  for (const auto& [name, size] : sizes) {
    const PointsRead read = ReadPath(Models() / "Collada" / name);
    ASSERT_TRUE(read.status.ok()) << read.status;
    EXPECT_EQ(read.counts.points, size) << name;
    EXPECT_FALSE(read.all_float());
    const auto mesh = ReadMesh((Models() / "Collada" / name).string());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->vertices.size(), size) << name;
    EXPECT_GT(mesh->triangles.size(), 0u) << name;
  }
  for (const auto& [name, reason] :
       {std::pair("box_nested_animation.dae", "a skin or morph targets"),
        std::pair("library_animation_clips.dae", "a skin or morph targets"),
        std::pair("cameras.dae", "contains no vertex"), std::pair("lights.dae", "no vertex"),
        std::pair("teapots.DAE", ":15: \"0,010000\" is not a number (use a point"),
        std::pair("cube_UTF16LE.dae", "iconv")}) {
    EXPECT_THAT(ReadPath(Models() / "Collada" / name).error(), HasSubstr(reason)) << name;
  }
}

TEST(RealFiles, NonFiniteGltfPointsAreFound) {
  const fs::path path = Models() / "glTF2/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb";
  SKIP_WITHOUT(path);
  const PointsRead read = ReadPath(path);
  if (read.status.ok()) {
    for (const double coordinate : read.xyz()) EXPECT_TRUE(std::isfinite(coordinate));
  } else {
    EXPECT_THAT(read.error(), HasSubstr("--skip-nonfinite"));
  }
}

TEST(RealFiles, EveryModelOfAKnownFormatIsReadOrRefused) {
  SKIP_WITHOUT(Models());
  int ok = 0;
  int refused = 0;
  for (const auto& entry : fs::recursive_directory_iterator(Models())) {
    if (!entry.is_regular_file()) continue;
    const auto format = PointFormatOfPath(entry.path().string());
    if (!format.ok()) continue;
    const PointsRead read = ReadFile(entry.path().string(), *format);
    if (read.status.ok()) {
      ++ok;
    } else {
      ++refused;
      EXPECT_THAT(read.error(), HasSubstr(entry.path().filename().string()));
    }
    (void)ReadMesh(entry.path().string());
  }
  EXPECT_GT(ok, 50);
  EXPECT_GT(refused, 5);
}

TEST(RealFiles, Scans) {
  SKIP_WITHOUT(RealData());
  ExpectObjRead(RealData() / "stanford-bunny.obj", 35947);
  ExpectObjRead(RealData() / "rocker-arm.obj", 10044);
  ExpectObjRead(RealData() / "spot.obj", 2930);
  int links = 0;
  for (const auto& entry : fs::directory_iterator(RealData() / "ur5")) {
    const PointsRead read = ReadPath(entry.path());
    ASSERT_TRUE(read.status.ok()) << read.status;
    EXPECT_GT(read.counts.points, 100u);
    EXPECT_EQ(read.counts.points % 3, 0u);
    ++links;
  }
  EXPECT_EQ(links, 7);
}

}  // namespace real_files_test
}  // namespace hulld
