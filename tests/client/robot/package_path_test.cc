#include "client/robot/package_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace hulld {
namespace package_path_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

class PackagePath : public testing::Test {
 protected:
  PackagePath() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::path(testing::TempDir()) / (std::string("packages_") + info->name());
    fs::remove_all(root_);
    paths_.description = Make("ws/src/arm_description/urdf/arm.urdf");
  }
  ~PackagePath() override { fs::remove_all(root_); }

  std::string Make(const std::string& path) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << "x";
    return (root_ / path).string();
  }
  std::string At(const std::string& path) const { return (root_ / path).string(); }
  std::string Resolve(const std::string& name) const {
    const auto file = ResolveFile(paths_, name);
    return file.ok() ? *file : file.status().ToString();
  }

  fs::path root_;
  PackagePaths paths_;
};

TEST_F(PackagePath, ANamedFolderComesFirst) {
  const std::string named = Make("elsewhere/meshes/a.stl");
  Make("ws/src/arm_description/meshes/a.stl");
  paths_.named["arm_description"] = At("elsewhere");
  EXPECT_EQ(Resolve("package://arm_description/meshes/a.stl"), named);
}

TEST_F(PackagePath, EnvironmentIsSearched) {
  const std::string direct = Make("ros/tool/a.stl");
  const std::string itself = Make("other/hand/a.stl");
  const std::string nested = Make("ros/repository/nested/a.stl");
  const std::string shared = Make("ament/share/gripper/a.stl");
  paths_.ros_package_path = SplitPath(At("ros") + "::" + At("other/hand"));
  paths_.ament_prefix_path = {At("ament")};
  EXPECT_EQ(Resolve("package://tool/a.stl"), direct);
  EXPECT_EQ(Resolve("package://hand/a.stl"), itself);
  EXPECT_EQ(Resolve("package://nested/a.stl"), nested);
  EXPECT_EQ(Resolve("model://gripper/a.stl"), shared);
}

TEST_F(PackagePath, FoldersAboveTheDescriptionAreSearched) {
  const std::string own = Make("ws/src/arm_description/meshes/a.stl");
  const std::string beside = Make("ws/src/tool/a.stl");
  EXPECT_EQ(Resolve("package://arm_description/meshes/a.stl"), own);
  EXPECT_EQ(Resolve("package://tool/a.stl"), beside);
}

// Exporters write no name for the package of the description itself.
TEST_F(PackagePath, APackageWithoutANameIsTheFolderOfTheDescription) {
  const std::string file = Make("ws/src/arm_description/urdf/meshes/a.stl");
  EXPECT_EQ(Resolve("package:///meshes/a.stl"), file);
  EXPECT_THAT(Resolve("package:///b.stl"), HasSubstr("no such file"));
}

TEST_F(PackagePath, OtherNamesAreFiles) {
  const std::string file = Make("ws/src/arm_description/urdf/a.stl");
  EXPECT_EQ(Resolve("a.stl"), file);
  EXPECT_EQ(Resolve("file://" + file), file);
  EXPECT_EQ(Resolve(file), file);
  EXPECT_EQ(Resolve("file://localhost" + file), file);
  EXPECT_EQ(Resolve("file:" + file), file);
  EXPECT_THAT(Resolve("b.stl"), HasSubstr("no such file"));
}

TEST_F(PackagePath, UrisMayContainEscapes) {
  const std::string file = Make("ws/src/arm_description/my part.stl");
  const std::string percent = Make("ws/src/arm_description/my%20tool.stl");
  EXPECT_EQ(Resolve("package://arm_description/my%20part.stl"), file);
  EXPECT_EQ(Resolve("file://" + At("ws/src/arm_description/my%20part.stl")), file);
  EXPECT_EQ(Resolve("package://arm_description/my%20tool.stl"), percent);
}

TEST_F(PackagePath, PathsMayHaveTheSeparatorOfWindows) {
  const std::string file = Make("ws/src/arm_description/urdf/meshes/a.stl");
  EXPECT_EQ(Resolve("meshes\\a.stl"), file);
  EXPECT_EQ(Resolve("package://arm_description/urdf\\meshes\\a.stl"), file);
  const std::string backslash = Make("ws/src/arm_description/urdf/meshes\\a.stl");
  EXPECT_EQ(Resolve("meshes\\a.stl"), backslash);
}

TEST_F(PackagePath, ErrorsListTheSearchedFolders) {
  EXPECT_THAT(Resolve("package://tool/a.stl"),
              testing::AllOf(HasSubstr("no folder of the package \"tool\" contains a.stl"),
                             HasSubstr("--package tool=DIR"), HasSubstr(At("ws/src/tool"))));
  EXPECT_THAT(Resolve("package://tool"), HasSubstr("is not a package file"));
}

}  // namespace package_path_test
}  // namespace hulld
