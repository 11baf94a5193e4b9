// The invalid files of Debian's package assimp-testmodels: the reader and `hullctl append` refuse
// each with an error that names the file and the fault. Skipped with a message if the package is
// not installed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "client/formats/mesh_file.h"
#include "client/hullctl/hullctl.h"
#include "tests/client/formats/point_reading.h"
#include "tests/server/harness/test_server.h"

namespace hulld {
namespace invalid_models_test {

namespace fs = std::filesystem;

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr char kModels[] = "/usr/share/assimp/models";

// Returns the files of its folder of invalid models, and the broken ones in other folders.
std::vector<fs::path> InvalidModels() {
  const fs::path models = kModels;
  std::vector<fs::path> paths = {
      models / "OBJ/box_UTF16BE.obj",
      models / "OBJ/number_formats.obj",
      models / "OFF/invalid.off",
      models / "PLY/issue623.ply",
      models / "PLY/pond.0.ply",
      models / "glTF2/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb",
      models / "glTF2/MissingBin/BoxTextured.gltf",
      // The other files of this folder have invalid materials, which are not read.
      models / "glTF2/wrongTypes/badArray.gltf",
  };
  for (const char* folder : {"invalid"}) {
    for (const auto& entry : fs::directory_iterator(models / folder)) {
      // glTF files are accompanied by their data files.
      const bool is_model =
          entry.path().extension() != ".bin" && entry.path().extension() != ".png";
      if (entry.is_regular_file() && is_model) paths.push_back(entry.path());
    }
  }
  return paths;
}

class InvalidModel : public server::ServerTest {
 protected:
  void SetUp() override {
    if (!fs::exists(kModels)) GTEST_SKIP() << "skipped: no data at " << kModels;
    ServerTest::SetUp();
  }
};

TEST_F(InvalidModel, IsRefusedByItsReader) {
  int known = 0;
  for (const fs::path& path : InvalidModels()) {
    const auto format = PointFormatOfPath(path.string());
    if (!format.ok()) {
      EXPECT_THAT(std::string(format.status().message()), HasSubstr("gltf"));
      continue;
    }
    const PointsRead read = ReadFile(path.string(), *format);
    EXPECT_EQ(read.status.code(), absl::StatusCode::kInvalidArgument) << path;
    EXPECT_THAT(read.error(), HasSubstr(path.string()));
    const auto mesh = ReadMesh(path.string());
    EXPECT_TRUE(!mesh.ok() || mesh->triangles.empty()) << path;
    ++known;
  }
  EXPECT_GE(known, 15);
}

TEST_F(InvalidModel, IsRefusedByAppend) {
  const std::vector<fs::path> paths = InvalidModels();
  EXPECT_GE(paths.size(), 22u);
  for (const fs::path& path : paths) {
    std::ostringstream out;
    std::ostringstream err;
    const int code = RunHullctl(
        {"append", "model", path.string(), "--create", "--server", server_->address()}, out, err);
    EXPECT_EQ(code, 2) << path;
    EXPECT_THAT(err.str(), AllOf(HasSubstr("hullctl: "), HasSubstr(path.string())));
    if (PointFormatOfPath(path.string()).ok()) {
      EXPECT_THAT(err.str(), Not(HasSubstr("unknown file extension")));
    } else {
      // Lists the accepted formats.
      EXPECT_THAT(err.str(), HasSubstr("obj, off, ply, xyz, csv, pcd, stl, gltf, glb, dae"));
    }
  }
}

}  // namespace invalid_models_test
}  // namespace hulld
