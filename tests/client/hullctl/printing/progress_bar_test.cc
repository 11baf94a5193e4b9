#include "client/hullctl/printing/progress_bar.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "client/hullctl/printing/painter.h"

namespace hulld {
namespace progress_bar_test {

TEST(ProgressBar, ShowsShareAmountRateAndTimeLeft) {
  EXPECT_EQ(ProgressText({50, 100, 1200, "points"}, 3),
            "[###############---------------]  50 %  1200 points  400 points/s  3 s left");
  EXPECT_EQ(ProgressText({5, 0, 7, "points"}, 2), "7 points  4 points/s");
  EXPECT_EQ(ProgressText({5, 0, 7, "points"}, 0.01), "7 points");
  EXPECT_EQ(ProgressText({200, 100, 1, "points"}, 1),
            "[##############################] 100 %  1 points  1 points/s  0 s left");
  EXPECT_EQ(ProgressText({1, 1000, 1, "pairs"}, 10),
            "[------------------------------]   0 %  1 pairs  0 pairs/s  2 h left");
  EXPECT_EQ(ProgressText({1, 100, 1, "pairs"}, 10),
            "[------------------------------]   1 %  1 pairs  0 pairs/s  16 min left");
  EXPECT_EQ(ProgressText({0, 0, 123456789, "B"}, 10), "123.5 MB  12.3 MB/s");
  EXPECT_EQ(ProgressText({0, 0, 20000, "points"}, 10), "20.0k points  2000 points/s");
}

TEST(ProgressBar, ShowsNothingAtOnceOrWhenHidden) {
  std::ostringstream out;
  ProgressBar hidden(out, false, "points", 10);
  hidden.Update(5, 1);
  hidden.Clear();
  ProgressBar quick(out, true, "points", 10);
  quick.Update(5, 1);
  quick.Clear();
  EXPECT_EQ(out.str(), "");
}

TEST(Painter, ColorsAreForTerminalsThatSupportThem) {
  setenv("TERM", "xterm", 1);
  unsetenv("NO_COLOR");
  EXPECT_TRUE(WantsColor("auto", true));
  EXPECT_FALSE(WantsColor("auto", false));
  setenv("NO_COLOR", "", 1);
  EXPECT_TRUE(WantsColor("auto", true));
  setenv("NO_COLOR", "1", 1);
  EXPECT_FALSE(WantsColor("auto", true));
  EXPECT_TRUE(WantsColor("always", false));
  unsetenv("NO_COLOR");
  setenv("TERM", "dumb", 1);
  EXPECT_FALSE(WantsColor("auto", true));
  EXPECT_FALSE(WantsColor("never", true));
  EXPECT_EQ(Painter(true)(Hue::kBad, "x"), "\x1b[31mx\x1b[0m");
  EXPECT_EQ(VisibleWidth("\x1b[31mxm\x1b[0m y"), 4U);
}

}  // namespace progress_bar_test
}  // namespace hulld
