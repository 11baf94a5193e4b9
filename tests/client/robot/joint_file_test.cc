#include "client/robot/joint_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/robot/urdf_file.h"
#include "tests/client/formats/point_reading.h"
#include "tests/client/robot/urdf_text.h"

namespace hulld {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class JointFile : public testing::Test {
 protected:
  // All waypoints of a table, or what is wrong with it.
  std::string Read(const std::string& text) {
    const TempFile file("joints.csv", text);
    const auto source = ByteSource::Open(file.path());
    EXPECT_TRUE(source.ok());
    waypoints_.clear();
    auto reader = WaypointReader::Open(source->get(), robot_);
    if (!reader.ok()) return reader.status().ToString();
    for (std::vector<double> values;;) {
      const auto more = reader->Next(&values);
      if (!more.ok()) return more.status().ToString();
      if (!*more) return "";
      waypoints_.push_back(values);
    }
  }

  const Robot robot_ = *ParseUrdf(kArmUrdf, "arm.urdf");
  std::vector<std::vector<double>> waypoints_;
};

TEST_F(JointFile, ColumnsGoToTheirJoints) {
  for (const char* text : {"# a path\ntime,slide,shoulder\n0,0.6,1\n\n# half way\n1,0.7,-1\n",
                           "time;\"slide\";shoulder\n0;0.6;1\n1;0.7;-1\n",
                           "time slide shoulder\n0 0.6 1\n1  0.7 -1\n"}) {
    EXPECT_EQ(Read(text), "") << text;
    EXPECT_THAT(waypoints_, ElementsAre(ElementsAre(1, 0, 0.6), ElementsAre(-1, 0, 0.7))) << text;
  }
}

TEST_F(JointFile, ErrorsNameTheLine) {
  EXPECT_THAT(Read("shoulder,elbo\n"), HasSubstr("joints.csv:1: \"elbo\" is no joint"));
  EXPECT_THAT(Read("follow\n1\n"), HasSubstr(":1: \"follow\" follows shoulder; leave it out"));
  EXPECT_THAT(Read("bolt\n1\n"), HasSubstr(":1: \"bolt\" is fixed"));
  EXPECT_THAT(Read("elbow,elbow\n"), HasSubstr(":1: \"elbow\" has two columns"));
  EXPECT_THAT(Read("elbow\n1\n1,2\n"), HasSubstr(":3: the header has 1 columns, this row 2"));
  EXPECT_THAT(Read("elbow\nx\n"), HasSubstr(":2: \"x\" is not a number"));
  EXPECT_THAT(Read("elbow\ninf\n"), HasSubstr(":2: \"inf\" is not a finite number"));
  EXPECT_THAT(Read("time\n1\n"), HasSubstr("no header that names joints"));
  EXPECT_THAT(Read(""), HasSubstr("no header that names joints"));
}

}  // namespace
}  // namespace hulld
