// Scenes of COLLADA files: nodes, transforms, references, and hostile nesting.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client/formats/text_number.h"
#include "tests/client/formats/dae/dae_text.h"

namespace hulld {
namespace dae_scene_test {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

constexpr std::string_view kNumbers = "0 0 0 200 0 0 0 0 50";
constexpr char kNode[] = "<node id=\"plate\"><instance_geometry url=\"#plate-mesh\"/></node>";
constexpr char kShown[] = "<instance_geometry url='#plate-mesh'/>";

std::string Error(const std::string& text) { return ReadDaeText(text).error(); }

// A file whose scene has these nodes.
std::string Scene(const std::string& nodes) { return DaeText(kNode, nodes); }

// Returns the image of (1, 2, 3) under the transforms of a node.
std::vector<double> Image(const std::string& transforms) {
  const std::string text = DaeReplaced(Scene(absl::StrCat("<node>", transforms, kShown, "</node>")),
                                       kNumbers, "1 2 3 0 0 0 0 0 0");
  const PointsRead read = ReadDaeText(text);
  EXPECT_TRUE(read.status.ok()) << read.status;
  const std::vector<double> all = read.xyz();
  return {all.begin(), all.begin() + std::min<std::ptrdiff_t>(3, std::ssize(all))};
}

TEST(DaeScene, EachTransformMovesTheMesh) {
  EXPECT_THAT(Image("<translate>10 20 30</translate>"), ElementsAre(11, 22, 33));
  EXPECT_THAT(Image("<scale>2 -1 0.5</scale>"), ElementsAre(2, -2, 1.5));
  EXPECT_THAT(Image("<matrix>0 -1 0 10 1 0 0 20 0 0 1 30 0 0 0 1</matrix>"),
              ElementsAre(8, 21, 33));
  EXPECT_THAT(Image("<lookat>5 0 0  6 0 0  0 0 1</lookat>"), ElementsAre(2, -1, 2));
  EXPECT_THAT(Image("<skew>45 0 2 0 3 0 0</skew>"), ElementsAre(DoubleNear(3, 1e-15), 2, 3));
  EXPECT_THAT(Image("<unknown>1</unknown>"), ElementsAre(1, 2, 3));
}

// The sine and cosine of multiples of 90 degrees are exact.
TEST(DaeScene, QuarterTurnsAreExact) {
  EXPECT_THAT(Image("<rotate>0 0 1 90</rotate>"), ElementsAre(-2, 1, 3));
  EXPECT_THAT(Image("<rotate>0 0 -7 -450</rotate>"), ElementsAre(-2, 1, 3));
  EXPECT_THAT(Image("<rotate>0 0 1 180</rotate>"), ElementsAre(-1, -2, 3));
  EXPECT_THAT(Image("<rotate>1 0 0 90</rotate>"), ElementsAre(1, -3, 2));
  EXPECT_THAT(Image("<rotate>0 1 0 270</rotate>"), ElementsAre(-3, 2, 1));
  EXPECT_THAT(Image("<rotate>0 1e-200 0 -90</rotate>"), ElementsAre(-3, 2, 1));
}

TEST(DaeScene, OtherTurnsFollowTheRightHand) {
  const double s = std::sin(0.5);
  const double c = std::cos(0.5);
  const std::string angle = absl::StrCat(ShortestText(90 / std::acos(0.0) * 0.5));
  const std::vector<double> z = Image("<rotate>0 0 2 " + angle + "</rotate>");
  EXPECT_THAT(z, ElementsAre(DoubleNear(c - 2 * s, 4e-15), DoubleNear(s + 2 * c, 4e-15), 3));
  // A third of a turn about the diagonal permutes the axes.
  EXPECT_THAT(Image("<rotate>1 1 1 120</rotate>"),
              ElementsAre(DoubleNear(3, 4e-15), DoubleNear(1, 4e-15), DoubleNear(2, 4e-15)));
}

TEST(DaeScene, TransformsApplyFromTheLastToTheFirst) {
  EXPECT_THAT(Image("<translate>10 0 0</translate><scale>2 2 2</scale>"), ElementsAre(12, 4, 6));
  EXPECT_THAT(Image("<scale>2 2 2</scale><translate>10 0 0</translate>"), ElementsAre(22, 4, 6));
  EXPECT_THAT(Image("<rotate>0 0 1 90</rotate><translate>10 0 0</translate>"),
              ElementsAre(-2, 11, 3));
  const std::string nested = Scene(absl::StrCat(
      "<node><translate>10 0 0</translate><node><scale>2 2 2</scale>", kShown, "</node></node>"));
  EXPECT_THAT(ReadDaeText(nested).xyz(), ElementsAre(10, 0, 0, 410, 0, 0, 10, 0, 100));
}

TEST(DaeScene, IdentitiesChangeNoBit) {
  const std::string text = DaeText(kNumbers, "-0 0.1 5e-324 1e308 0 0 9007199254740993 0 0");
  const std::string identity =
      "<matrix>1 0 0 0 0 1 -0 0 0 0 1 0 0 0 0 1</matrix><rotate>0 0 0 0</rotate>"
      "<rotate>1 2 3 720</rotate><scale>1 1 1</scale><translate>0 0 -0</translate>"
      "<translate>5 0 0</translate><translate>-5 0 0</translate><rotate>0 1 0 90</rotate>"
      "<rotate>0 1 0 -90</rotate>";
  const PointsRead read =
      ReadDaeText(DaeReplaced(text, "<instance_geometry", identity + "<instance_geometry"));
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_EQ(read.xyz(), ReadDaeText(text).xyz());
  EXPECT_TRUE(std::signbit(read.xyz()[0]));
}

TEST(DaeScene, TransformsWithoutMeaningAreRefused) {
  const auto error = [](const std::string& transform) {
    return Error(Scene(absl::StrCat("<node>", transform, kShown, "</node>")));
  };
  EXPECT_EQ(error("<translate>1 2</translate>"), "FILE:15: <translate> is not 3 finite numbers");
  EXPECT_THAT(error("<translate>1 2 3 4</translate>"), HasSubstr("3 finite numbers"));
  EXPECT_THAT(error("<scale>1 inf 3</scale>"), HasSubstr("3 finite numbers"));
  EXPECT_EQ(error("<rotate>0 0 1 147,423584</rotate>"),
            "FILE:15: \"147,423584\" is not a number (use a point as the decimal mark)");
  EXPECT_EQ(error("<rotate>0 0 0 90</rotate>"), "FILE:15: <rotate> has a direction of length 0");
  EXPECT_THAT(error("<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2</matrix>"),
              HasSubstr("<matrix> has a last row other than 0 0 0 1"));
  EXPECT_THAT(error("<matrix>1</matrix>"), HasSubstr("<matrix> is not 16 finite numbers"));
  EXPECT_THAT(error("<lookat>1 1 1 1 1 1 0 0 1</lookat>"),
              HasSubstr("has a direction of length 0"));
  EXPECT_THAT(error("<lookat>0 0 0 0 0 1 0 0 1</lookat>"),
              HasSubstr("has a direction of length 0"));
  EXPECT_THAT(error("<skew>45 1 0 0 1 1 0</skew>"), HasSubstr("not at right angles"));
  EXPECT_THAT(error("<skew>90 1 0 0 0 1 0</skew>"), HasSubstr("an angle of 90"));
}

TEST(DaeScene, NodesAreShownAsOftenAsTheyAreInstanced) {
  const std::string text = DaeReplaced(
      Scene("<node id='a'><translate>0 1 0</translate><instance_node url='#screw'/>"
            "<instance_node url='#screw'/></node><node><instance_node url='#a'/></node>"),
      "<library_nodes/>",
      absl::StrCat("<library_nodes><node id='screw'><scale>0.5 1 1</scale>", kShown, kShown,
                   "</node></library_nodes>"));
  const PointsRead read = ReadDaeText(text);
  EXPECT_EQ(read.counts.points, 24u) << read.status;
  EXPECT_EQ(read.xyz()[3], 100);
  EXPECT_EQ(read.xyz()[4], 1);
  // Each is a part of its own.
  const auto parts = DaeParts(text);
  ASSERT_THAT(parts, SizeIs(4));
  EXPECT_EQ(parts[3].name, "screw");
  EXPECT_THAT(parts[3].mesh.triangles, SizeIs(2));
}

TEST(DaeScene, PartsAreNodes) {
  const std::string text = Scene(absl::StrCat("<node name='a'><node sid='b'>", kShown, "</node>",
                                              kShown, "</node><node>", kShown, "</node>"));
  const auto parts = DaeParts(text);
  ASSERT_THAT(parts, SizeIs(3));
  EXPECT_EQ(parts[0].name, "b");
  EXPECT_EQ(parts[1].name, "a");
  EXPECT_EQ(parts[2].name, "");
}

TEST(DaeScene, TheSceneOfTheFileIsShown) {
  const std::string two =
      DaeText("<library_visual_scenes>",
              absl::StrCat("<library_visual_scenes><visual_scene id='other'><node><translate>0 0 1"
                           "</translate>",
                           kShown, "</node></visual_scene>"));
  EXPECT_THAT(ReadDaeText(two).xyz(), SizeIs(9));
  EXPECT_EQ(ReadDaeText(two).xyz()[2], 0);
  EXPECT_EQ(ReadDaeText(DaeReplaced(two, "url=\"#scene\"", "url=\"#other\"")).xyz()[2], 1);
  // Without a scene, all visual scenes are shown; without these, all geometries.
  const std::string scene = "<scene><instance_visual_scene url=\"#scene\"/></scene>";
  EXPECT_THAT(ReadDaeText(DaeReplaced(two, scene, "")).xyz(), SizeIs(18));
  EXPECT_THAT(ReadDaeText(DaeReplaced(two, scene, "<scene/>")).xyz(), SizeIs(18));
  std::string bare = DaeReplaced(DaeText(), scene, "");
  bare = DaeReplaced(bare, "<visual_scene id=\"scene\">", "");
  bare = DaeReplaced(bare, "</visual_scene>", "");
  EXPECT_THAT(ReadDaeText(bare).xyz(), ElementsAre(0, 0, 0, 200, 0, 0, 0, 0, 50));
  EXPECT_EQ(DaeParts(bare).at(0).name, "plate-mesh");
}

TEST(DaeScene, ReferencesMustHaveOneTarget) {
  EXPECT_EQ(Error(Scene("<node><instance_geometry url='#x'/></node>")),
            "FILE:15: <instance_geometry> refers to \"#x\", the ID of no geometry");
  EXPECT_EQ(Error(Scene("<node><instance_node url='#plate-mesh'/></node>")),
            "FILE:15: <instance_node> refers to \"#plate-mesh\", the ID of no node");
  EXPECT_EQ(
      Error(Scene("<node><instance_node url='other.dae#x'/></node>")),
      "FILE:15: <instance_node> refers to \"other.dae#x\", not in this file; merge the files");
  EXPECT_THAT(Error(Scene("<node><instance_node/></node>")), HasSubstr("refers to \"\", not in"));
  EXPECT_EQ(Error(Scene("<node id='a'/><node id='a'/><node><instance_node url='#a'/></node>")),
            "FILE:15: <instance_node> refers to \"#a\", the ID of more than one node");
  EXPECT_THAT(
      Error(DaeText("url=\"#scene\"", "url=\"#x\"")),
      HasSubstr("FILE:17: <instance_visual_scene> refers to \"#x\", the ID of no visual_scene"));
  // A node may have the ID of a geometry; IDs may contain any characters.
  std::string text = DaeText("<node id=\"plate\"", "<node id=\"plate-mesh\"");
  EXPECT_EQ(Error(text), "");
  text = DaeReplaced(text, "id=\"plate-mesh\"", "id=\"&lt;a b&quot;%20\"");
  EXPECT_EQ(Error(DaeReplaced(text, "url=\"#plate-mesh\"", "url=\"#&lt;a b&quot;%20\"")), "");
  text = DaeReplaced(text, "%20", "");
  EXPECT_EQ(Error(DaeReplaced(text, "url=\"#plate-mesh\"", "url=\"#%3Ca%20b&quot;\"")), "");
}

TEST(DaeScene, UnsupportedElementsAreRefusedByName) {
  EXPECT_THAT(
      Error(Scene("<node><instance_controller url='#skin'/></node>")),
      HasSubstr("FILE:15: <instance_controller> instantiates a mesh with a skin or morph targets"));
  std::string text = DaeText("<mesh>", "<spline>");
  text = DaeReplaced(text, "</mesh>", "</spline>");
  EXPECT_THAT(Error(text), HasSubstr("FILE:4: <geometry> is not a <mesh>"));
}

TEST(DaeScene, NodesThatInstantiateThemselvesAreRefused) {
  EXPECT_THAT(
      Error(Scene("<node id='a'><instance_node url='#a'/></node>")),
      HasSubstr("FILE:15: <node> is nested deeper than 256 levels; does it instantiate itself?"));
  EXPECT_THAT(Error(Scene("<node id='a'><node><instance_node url='#b'/></node></node>"
                          "<node id='b'><instance_node url='#a'/></node>")),
              HasSubstr("does it instantiate itself?"));
}

// 2^30 nodes in a file of 2 KB.
TEST(DaeScene, ExponentiallyManyNodesAreRefused) {
  std::string nodes;
  for (int i = 0; i < 30; ++i) {
    const std::string next = absl::StrCat("<instance_node url='#n", i + 1, "'/>");
    absl::StrAppend(&nodes, "<node id='n", i, "'>", next, next, "</node>\n");
  }
  EXPECT_THAT(Error(Scene(nodes + "<node id='n30'/>")),
              HasSubstr("is instantiated too often: the scene has more than 1048576 elements"));
}

// 100,000 triangles, 1,000 times.
TEST(DaeScene, TooManyInstancesOfTrianglesAreRefused) {
  std::string indices;
  for (int i = 0; i < 100000; ++i) indices += "0 1 2 ";
  std::string nodes = "<node>";
  for (int i = 0; i < 1000; ++i) absl::StrAppend(&nodes, kShown);
  std::string text = DaeReplaced(Scene(nodes + "</node>"), "0 1 2", indices);
  text = DaeReplaced(text, "<triangles count=\"1\">", "<triangles>");
  EXPECT_THAT(Error(text),
              HasSubstr("too often: the scene has more than 268435456 vertices and corners"));
}

// The parser does not recurse.
TEST(DaeScene, AMillionNestedElementsAreRead) {
  constexpr int kDepth = 1000000;
  std::string open;
  std::string close;
  for (int i = 0; i < kDepth; ++i) {
    open += "<a>";
    close += "</a>";
  }
  EXPECT_EQ(Error(DaeText("<library_nodes/>", open + close)), "");
  EXPECT_THAT(Error(DaeText("<library_nodes/>", open)), HasSubstr("not well-formed XML"));
}

}  // namespace dae_scene_test
}  // namespace hulld
