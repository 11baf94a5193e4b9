#include "client/robot/joint_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/robot/urdf_file.h"
#include "tests/client/formats/point_reading.h"
#include "tests/client/robot/urdf_text.h"

namespace hulld {
namespace joint_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

class JointFile : public testing::Test {
 protected:
  // Returns all waypoints of a table, or its error.
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

TEST_F(JointFile, ColumnsAreAssignedToTheirJoints) {
  for (const char* text :
       {"# a path\ntime,slide,shoulder\n0,0.6,1\n\n# half way\n1,0.7,-1\n",
        "time;\"slide\";shoulder\n0;0.6;1\n1;0.7;-1\n", "time slide shoulder\n0 0.6 1\n1  0.7 -1\n",
        "\"time\" \"slide\" \"shoulder\"\n0 0.6 1\n1 0.7 -1\n"}) {
    EXPECT_EQ(Read(text), "") << text;
    EXPECT_THAT(waypoints_, ElementsAre(ElementsAre(1, 0, 0.6), ElementsAre(-1, 0, 0.7))) << text;
  }
}

TEST(LooseJointFile, PosesAndPlanarValuesHaveColumns) {
  const auto robot = ParseUrdf(
      "<robot name='r'><link name='w'/><link name='a'/><link name='b'/><joint name='f' "
      "type='floating'><parent link='w'/><child link='a'/></joint><joint name='p' type='planar'>"
      "<parent link='w'/><child link='b'/><axis xyz='0 0 1'/></joint></robot>",
      "r.urdf");
  ASSERT_TRUE(robot.ok()) << robot.status();
  const auto read = [&](const std::string& text, std::vector<double>* values) {
    const TempFile file("joints.csv", text);
    const auto source = ByteSource::Open(file.path());
    auto reader = WaypointReader::Open(source->get(), *robot);
    return reader.ok() ? reader->Next(values).status().ToString() : reader.status().ToString();
  };
  std::vector<double> values;
  EXPECT_EQ(read("p/theta,f/rot_w,f/rot_x,f/rot_y,f/rot_z,f/trans_y\n0.5,1,2,3,4,5\n", &values),
            "OK");
  EXPECT_THAT(values, ElementsAre(0, 5, 0, 2, 3, 4, 1, 0, 0, 0.5));
  EXPECT_EQ(read("p/x\n7\n", &values), "OK");
  EXPECT_THAT(values, ElementsAre(0, 0, 0, 0, 0, 0, 1, 7, 0, 0));
  EXPECT_THAT(read("f\n1\n", &values),
              HasSubstr(":1: \"f\" has several values; its columns are f/trans_x, f/trans_y"));
  EXPECT_THAT(read("f/rot_z\n1\n", &values),
              HasSubstr(":1: the header has 1 of the 4 columns f/rot_x"));
  EXPECT_THAT(read("f/rot_w,f/rot_x,f/rot_y,f/rot_z\n0,0,0,0\n", &values),
              HasSubstr(":2: the quaternion of f is 0 0 0 0"));
}

TEST_F(JointFile, ErrorsNameTheLine) {
  EXPECT_THAT(Read("shoulder,elbo\n"), HasSubstr("joints.csv:1: \"elbo\" is not a joint"));
  EXPECT_THAT(Read("follow\n1\n"), HasSubstr(":1: \"follow\" follows shoulder; leave it out"));
  EXPECT_THAT(Read("bolt\n1\n"), HasSubstr(":1: \"bolt\" is fixed"));
  EXPECT_THAT(Read("elbow,elbow\n"), HasSubstr(":1: \"elbow\" has two columns"));
  EXPECT_THAT(Read("elbow\n1\n1,2\n"),
              HasSubstr(":3: the header has 1 column, but this row has 2"));
  EXPECT_THAT(Read("elbow\nx\n"), HasSubstr(":2: \"x\" is not a number"));
  EXPECT_THAT(Read("elbow\ninf\n"), HasSubstr(":2: \"inf\" is not a finite number"));
  EXPECT_THAT(Read("time\n1\n"), HasSubstr("no header with joint names"));
  EXPECT_THAT(Read(""), HasSubstr("no header with joint names"));
}

}  // namespace joint_file_test
}  // namespace hulld
