#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace xyz_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(PtsFile, CountThenPointsWithIntensityAndColor) {
  EXPECT_THAT(ReadText("2\r\n1 2 3 -1204 255 0 7\r\n0.1 5 6 12 1 2 3\r\n", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3, 0.1, 5, 6));
  EXPECT_THAT(ReadText("# scan\n\n1\n1 2 3\n", PointFormat::kXyz).xyz(), ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("//X;Y;Z;R\n2\n1;2;3;0\n4;5;6;0\n", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
}

// z was read as x.
TEST(PtsFile, ACountAfterACommentWithOtherColumnsIsAnError) {
  EXPECT_EQ(
      ReadText("//Z;Y;X;R\n1\n3;2;1;0\n", PointFormat::kXyz).error(),
      "FILE:3: the comment at the start names x, y, and z, but not as the first three columns, "
      "and a number of points follows; remove that number");
  EXPECT_THAT(ReadText("// about x, then y, then z\n1\n1 2 3\n", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3));
}

TEST(PtsFile, ReadsConsecutiveScans) {
  EXPECT_THAT(ReadText("1\n1 2 3 4\n0\n2\n4 5 6 7\n7 8 9 0\n", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST(PtsFile, CountMayBeMissing) {
  EXPECT_THAT(ReadText("1 2 3 4\n4 5 6 7\n", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(PtsFile, FewerOrMorePointsThanDeclaredAreErrors) {
  EXPECT_THAT(ReadText("3\n1 2 3 4\n4 5 6 7\n", PointFormat::kXyz).error(),
              HasSubstr("after 2 of 3 points; is it complete?"));
  EXPECT_EQ(ReadText("1\n1 2 3 4\n4 5 6 7\n", PointFormat::kXyz).error(),
            "FILE:3: the scan has more lines than the 1 point it declares");
  EXPECT_EQ(ReadText("2\n1 2 3 4\n5\n", PointFormat::kXyz).error(),
            "FILE:3: a point needs 3 coordinates, got 1");
  EXPECT_EQ(ReadText("1 2 3\n5\n", PointFormat::kXyz).error(),
            "FILE:2: a point needs 3 coordinates, got 1");
  EXPECT_EQ(ReadText("1\n1 x 3 4\n", PointFormat::kXyz).error(), "FILE:2: \"x\" is not a number");
}

TEST(PtsFile, ScansMayHaveDifferentColumns) {
  EXPECT_EQ(ReadText("1\n1 2 3\n2\n1 2 3 4\n5 6 7\n", PointFormat::kXyz).counts.points, 3u);
}

}  // namespace xyz_file_test
}  // namespace hulld
