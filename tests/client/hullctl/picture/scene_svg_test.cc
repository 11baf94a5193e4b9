#include "client/hullctl/picture/scene_svg.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "client/hullctl/load/point_generator.h"
#include "client/hullctl/picture/mesh_thinning.h"
#include "tests/client/hullctl/xml_check.h"

namespace hulld {
namespace scene_svg_test {

using testing::HasSubstr;
using testing::Not;

ScenePanel Points(const std::vector<std::array<double, 3>>& points) {
  return {ScenePanel::Kind::kPoints, "Points", {"a & <b>"}, points, {}, {}};
}

// A grid of 2 n n triangles in the plane z = 0.
ScenePanel GridMesh(ScenePanel::Kind kind, uint32_t n) {
  ScenePanel panel{kind, "Mesh", {"grid"}, {}, {}, {}};
  for (uint32_t y = 0; y <= n; ++y) {
    for (uint32_t x = 0; x <= n; ++x) panel.vertices.push_back({double(x), double(y), 0});
  }
  for (uint32_t y = 0; y < n; ++y) {
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t corner = y * (n + 1) + x;
      const uint32_t above = corner + n + 1;
      for (const uint32_t index : {corner, corner + 1, above, above, corner + 1, above + 1}) {
        panel.polygon_indices.push_back(index);
      }
      panel.polygon_sizes.insert(panel.polygon_sizes.end(), {3, 3});
    }
  }
  return panel;
}

std::vector<std::array<double, 3>> Ball(uint64_t count, double radius) {
  CloudOptions options;
  options.count = count;
  options.radius = radius;
  std::vector<std::array<double, 3>> points;
  GenerateCloud(options, [&](const auto& p) { points.push_back(p); });
  return points;
}

void ExpectGood(const std::string& svg) {
  EXPECT_EQ(XmlProblem(svg), "");
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
  EXPECT_LT(svg.size(), 1u << 20);
}

TEST(XmlCheck, FindsWhatIsWrong) {
  EXPECT_EQ(XmlProblem("<a b=\"c\"><d/>x &amp; y</a>\n"), "");
  for (const char* text :
       {"<a>", "<a></b>", "<a/><", "<a b=\"></a>", "<a>&x;</a>", "<a></a><b></b>", "x<a></a>"}) {
    EXPECT_NE(XmlProblem(text), "") << text;
  }
}

TEST(SceneSvg, IsWellFormedAndSmallHoweverMuchIsDrawn) {
  const std::string svg =
      RenderSceneSvg({Points(Ball(100000, 1)), GridMesh(ScenePanel::Kind::kMesh, 300),
                      GridMesh(ScenePanel::Kind::kHull, 200)},
                     UpAxis::kY);
  ExpectGood(svg);
  EXPECT_GT(svg.size(), 100000u);
  EXPECT_THAT(svg, HasSubstr("a &amp; &lt;b&gt;"));
}

TEST(SceneSvg, DrawsAnyMagnitude) {
  const double huge = std::numeric_limits<double>::max();
  const double tiny = std::numeric_limits<double>::denorm_min();
  for (const double scale : {huge, 1e300, 1e-300, tiny}) {
    std::vector<std::array<double, 3>> corners;
    for (int i = 0; i < 8; ++i) {
      corners.push_back({i & 1 ? scale : -scale, i & 2 ? scale : -scale, i & 4 ? scale : -scale});
    }
    const std::string svg = RenderSceneSvg({Points(corners)}, UpAxis::kZ);
    ExpectGood(svg);
    // The picture is equal at every scale.
    for (auto& corner : corners) {
      for (double& coordinate : corner) coordinate = coordinate > 0 ? 1 : -1;
    }
    EXPECT_EQ(svg, RenderSceneSvg({Points(corners)}, UpAxis::kZ)) << scale;
  }
}

TEST(SceneSvg, DrawsHullsOfEveryDimension) {
  ScenePanel hull{ScenePanel::Kind::kHull, "Hull", {}, {}, {}, {}};
  ExpectGood(RenderSceneSvg({hull}, UpAxis::kX));
  hull.vertices = {{5, 5, 5}};
  ExpectGood(RenderSceneSvg({hull}, UpAxis::kX));
  hull.vertices.push_back({6, 7, 8});
  const std::string segment = RenderSceneSvg({hull}, UpAxis::kX);
  ExpectGood(segment);
  EXPECT_THAT(segment, HasSubstr("stroke-width=\"1.5\""));
  hull.vertices.push_back({5, 9, 5});
  hull.polygon_sizes = {3};
  hull.polygon_indices = {0, 1, 2};
  ExpectGood(RenderSceneSvg({hull}, UpAxis::kX));
}

TEST(SceneSvg, TheUpAxisPointsUp) {
  // A pole along each axis: its top is drawn above its foot by most of the picture.
  const UpAxis axes[] = {UpAxis::kX, UpAxis::kY, UpAxis::kZ};
  for (size_t axis = 0; axis < 3; ++axis) {
    std::vector<std::array<double, 3>> pole(2, {0, 0, 0});
    pole[1][axis] = 1;
    const std::string svg = RenderSceneSvg({Points(pole)}, axes[axis]);
    std::vector<double> heights;
    for (size_t at = svg.find("d=\"M"); at != std::string::npos; at = svg.find('M', at + 5)) {
      const size_t space = svg.find(' ', at + 4);
      heights.push_back(std::stod(svg.substr(space + 1)));
    }
    ASSERT_EQ(heights.size(), 2u);
    // The foot is farther away and drawn first: the camera looks down. SVG counts from the top.
    EXPECT_GT(heights[0], heights[1] + 200);
  }
}

TEST(SceneSvg, NamesOfFilesCannotBreakTheXml) {
  ScenePanel panel = Points({{0, 0, 0}});
  panel.captions = {"\x01\xff\"'<svg>&&"};
  ExpectGood(RenderSceneSvg({panel}, UpAxis::kY));
}

TEST(MeshThinning, KeepsWithinTheLimitAndTheShape) {
  const ScenePanel grid = GridMesh(ScenePanel::Kind::kMesh, 100);
  std::vector<DrawnPoint> vertices;
  for (const auto& p : grid.vertices) vertices.push_back({p[0] / 50 - 1, p[1] / 50 - 1, 0});
  std::vector<DrawnTriangle> triangles;
  for (size_t i = 0; i < grid.polygon_indices.size(); i += 3) {
    triangles.push_back(
        {grid.polygon_indices[i], grid.polygon_indices[i + 1], grid.polygon_indices[i + 2]});
  }
  ThinOut(3000, &vertices, &triangles);
  EXPECT_LE(triangles.size(), 3000u);
  EXPECT_GT(triangles.size(), 1000u);
  double area = 0;
  for (const DrawnTriangle& t : triangles) {
    const DrawnPoint &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    area += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
  }
  // The rim shrinks by at most half a cell of about 2/35.
  EXPECT_NEAR(area, 4, 0.3);
}

TEST(GroupedDigits, SeparatesThousands) {
  EXPECT_EQ(GroupedDigits(0), "0");
  EXPECT_EQ(GroupedDigits(999), "999");
  EXPECT_EQ(GroupedDigits(1000), "1,000");
  EXPECT_EQ(GroupedDigits(1234567), "1,234,567");
}

}  // namespace scene_svg_test
}  // namespace hulld
