#include "client/hullctl/command_line/arguments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hulld {
namespace arguments_test {

using std::chrono::milliseconds;

TEST(Arguments, DurationsHaveUnits) {
  EXPECT_EQ(*ParseDuration("500ms"), milliseconds(500));
  EXPECT_EQ(*ParseDuration("30s"), milliseconds(30000));
  EXPECT_EQ(*ParseDuration("1.5"), milliseconds(1500));
  EXPECT_EQ(*ParseDuration("2m"), milliseconds(120000));
  EXPECT_EQ(*ParseDuration("24h"), milliseconds(86400000));
  for (const char* text :
       {"", "s", "0", "-1s", "25h", "1e999s", "nan", "inf", "5 s", "5d", "0.1ms"}) {
    EXPECT_FALSE(ParseDuration(text).ok()) << text;
  }
}

TEST(Arguments, PosesAreThreeOrSevenNumbers) {
  const auto moved = ParsePose("-1,1e-310, +0.1");
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_FALSE(moved->has_rotation());
  EXPECT_EQ(moved->translation().x(), -1);
  EXPECT_EQ(moved->translation().y(), 1e-310);
  EXPECT_EQ(moved->translation().z(), 0.1);
  const auto turned = ParsePose("2,1,0,0,5,6,7");
  ASSERT_TRUE(turned.ok()) << turned.status();
  EXPECT_EQ(turned->rotation().w(), 2);
  EXPECT_EQ(turned->rotation().x(), 1);
  EXPECT_EQ(turned->translation().z(), 7);
  for (const char* text : {"", "1", "1,2", "1,2,3,4", "1,2,3,4,5,6,7,8", "1,2,x", "1,2,nan",
                           "1,2,1e999", "0,0,0,0,1,2,3", "1,2,3,"}) {
    EXPECT_FALSE(ParsePose(text).ok()) << text;
  }
}

TEST(Arguments, NumbersWithoutCommasAreExplained) {
  for (const char* text : {"1 0 0", "1 0 0, 2"}) {
    EXPECT_THAT(std::string(ParsePose(text).status().message()),
                testing::HasSubstr("separate numbers with commas, as in 1,0,0"));
  }
  EXPECT_THAT(std::string(ParsePose("1,2").status().message()),
              testing::HasSubstr("3 comma-separated numbers, x,y,z, or 7, w,x,y,z,x,y,z"));
}

}  // namespace arguments_test
}  // namespace hulld
