#include "client/hullctl/view/view_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace view_scene_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ViewScene, AcceptsEachSceneFormat) {
  const TempFile yaml("scene.yaml",
                      "place: {left: {id: cube}, right: {id: cube, at: [1, 2, 3]}}\n");
  const TempFile json("scene.json", R"({"placements":[{"hullId":"cube"},{"hullId":"cube",
      "pose":{"translation":{"x":1,"y":2,"z":3}}}],"groups":[4,5]})");
  const TempFile packed("packed.json", R"({"packedPlacements":{"hullIds":["cube"],"hulls":[0,0],
      "poses":[1,0,0,0,0,0,0, 1,0,0,0,1,2,3]}})");
  for (const TempFile* file : {&yaml, &json, &packed}) {
    ViewScene scene;
    const absl::Status added = AddSceneFile(file->path(), &scene);
    ASSERT_TRUE(added.ok()) << added;
    ASSERT_EQ(scene.objects.size(), 2U);
    EXPECT_EQ(scene.objects[1].hull_id, "cube");
    EXPECT_THAT(scene.objects[1].pose, ElementsAre(1, 0, 0, 0, 1, 2, 3));
    EXPECT_EQ(scene.objects[1].name, file == &yaml ? "right" : "cube");
    // The page moves placements; the rules come from the file.
    EXPECT_EQ(scene.rules.placements_size() + scene.rules.packed_placements().hulls_size(), 0);
    EXPECT_EQ(scene.rules.groups_size(), file == &packed ? 0 : 2);
  }
  const TempFile wrong("wrong.json", "{\"placement\":[]}\n");
  ViewScene scene;
  EXPECT_THAT(std::string(AddSceneFile(wrong.path(), &scene).message()),
              HasSubstr(wrong.path() + ":1: "));
}

TEST(ViewScene, ScenesAreRecognizedByTheirExtensionOrTheirFirstLine) {
  constexpr char kScene[] = "# a scene\n\nplace: {left: {id: cube}}\n";
  for (const char* name : {"scene.yaml", "scene.yml", "scene.txt", "scene", "scene.v2"}) {
    EXPECT_TRUE(IsSceneFile(TempFile(name, kScene).path())) << name;
  }
  EXPECT_TRUE(IsSceneFile(TempFile("scene.txt", "{\"placements\": []}\n").path()));
  EXPECT_TRUE(IsSceneFile(TempFile("scene.txt", "place left cube\n").path()));
  EXPECT_FALSE(IsSceneFile(TempFile("points.txt", "# a cloud\n1 2 3\n").path()));
  EXPECT_FALSE(IsSceneFile(TempFile("points.xyz", "nan 2 3\n").path()));
  EXPECT_FALSE(IsSceneFile(TempFile("empty.txt", "").path()));
  EXPECT_FALSE(IsSceneFile(TempFile("points.csv", "x:1,y,z\n1,2,3\n").path()));
  EXPECT_FALSE(IsSceneFile(TempFile("points.txt", "Points:0,Points:1,Points:2\n1,2,3\n").path()));
  EXPECT_FALSE(IsSceneFile("/no/such/file.txt"));
}

TEST(ViewScene, PlyFilesAreMeshesOrClouds) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face ";
  const std::string rest = "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto mesh = ReadShape(
      TempFile("a.ply", head + "1" + rest + "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n").path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->point_count, 4u);
  EXPECT_THAT(mesh->triangles, ElementsAre(0, 1, 2));
  const auto cloud =
      ReadShape(TempFile("a.ply", head + "0" + rest + "0 0 0\n1 0 0\n0 1 0\nnan 0 1\n").path());
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->point_count, 3u);
  EXPECT_TRUE(cloud->triangles.empty());
}

TEST(ViewScene, ABodyOfASceneIsOneObject) {
  const TempFile file("cell.yaml",
                      "prefix: cell/\nhulls: {leg: {box: [1, 1, 1]}}\n"
                      "bodies: {stand: [{hull: leg}, {hull: leg, at: [2, 0, 0]}]}\n"
                      "place: {here: {body: stand, at: [1, 2, 3]}, beside: {hull: leg}}\n");
  ViewScene scene;
  const absl::Status added = AddSceneFile(file.path(), &scene);
  ASSERT_TRUE(added.ok()) << added;
  ASSERT_EQ(scene.objects.size(), 2U);
  EXPECT_EQ(scene.objects[0].name, "here");
  EXPECT_EQ(scene.objects[0].hull_id, "cell/stand");
  EXPECT_THAT(scene.objects[0].pose, ElementsAre(1, 0, 0, 0, 1, 2, 3));
  EXPECT_EQ(scene.objects[1].hull_id, "cell/leg");
}

TEST(ViewScene, NamedPairsAreThoseOfTheFile) {
  const TempFile all("all.yaml", "place: {a: {id: cube}, b: {id: cube}, c: {id: cube}}\n");
  const TempFile named("named.yaml",
                       "place: {a: {id: cube}, b: {id: cube}, c: {id: cube}}\n"
                       "ask: {pairs: [[c, a], [a, b]]}\n");
  ViewScene scene;
  ASSERT_TRUE(AddSceneFile(all.path(), &scene).ok());
  EXPECT_FALSE(scene.pairs.has_value());
  ViewScene some;
  ASSERT_TRUE(AddSceneFile(named.path(), &some).ok());
  ASSERT_TRUE(some.pairs.has_value());
  EXPECT_THAT(*some.pairs, ElementsAre(2, 0, 0, 1));
}

TEST(ViewScene, MotionsStartAtTheirPose) {
  const TempFile file("moving.yaml",
                      "place: {wall: {id: cube, at: [9, 0, 0], to: [9, 0, 0]},\n"
                      "        ball: {id: cube, at: [3, 0, 0], to: [1, 0, 0]}}\n");
  ViewScene scene;
  const absl::Status added = AddSceneFile(file.path(), &scene);
  ASSERT_TRUE(added.ok()) << added;
  ASSERT_EQ(scene.objects.size(), 2U);
  // It stays where it is.
  EXPECT_FALSE(scene.objects[0].motion.has_value());
  ASSERT_TRUE(scene.objects[1].motion.has_value());
  EXPECT_THAT(scene.objects[1].pose, ElementsAre(1, 0, 0, 0, 3, 0, 0));
  EXPECT_THAT(scene.objects[1].motion->end, ElementsAre(1, 0, 0, 0, 1, 0, 0));
}

TEST(ViewScene, PosesOfAMotionAreLinearAndNotNormalized) {
  const ViewMotion motion{{1, 0, 0, 0, 0.1, -3, 0}, {0, 0, 4, 0, 0.7, 1, 5}};
  EXPECT_EQ(PoseAt(motion, 0), motion.start);
  EXPECT_EQ(PoseAt(motion, 1), motion.end);
  EXPECT_THAT(PoseAt(motion, 0.25), ElementsAre(0.75, 0, 1, 0, 0.75 * 0.1 + 0.25 * 0.7, -2, 1.25));
}

}  // namespace view_scene_test
}  // namespace hulld
