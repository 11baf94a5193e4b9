// hullctl robot check --continuous, against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace continuous_check_test {

using testing::HasSubstr;
using testing::Not;

// A ball of radius 1/4 on a swinging arm of length 1, and a wall from x = `wall` on. The ball is
// nearest to the wall where the angle is 0: it reaches to x = 1.25.
std::string Swing(const std::string& wall) {
  return R"(<robot name="swing">
  <link name="wall"><collision><origin xyz=")" +
         wall + R"( 0 0"/><geometry><box size="1 4 4"/></geometry></collision></link>
  <joint name="hinge" type="continuous"><parent link="wall"/><child link="arm"/><axis xyz="0 0 1"/></joint>
  <link name="arm"><collision><origin xyz="1 0 0"/><geometry><sphere radius="0.25"/></geometry></collision></link>
</robot>)";
}

class Continuous : public HullctlOnServer {
 protected:
  Ran Check(const std::string& urdf, const std::string& path, std::vector<std::string> more = {}) {
    const TempFile description("swing.urdf", urdf);
    const TempFile waypoints("path.csv", path);
    more.insert(more.begin(), {"robot", "check", description.path(), "--adjacent", "--trajectory",
                               waypoints.path()});
    return Run(more);
  }
  Ran CheckMotion(const std::string& urdf, const std::string& path,
                  std::vector<std::string> more = {}) {
    more.emplace_back("--continuous");
    return Check(urdf, path, more);
  }

  // Returns the number after `label` in the output.
  static double NumberAfter(const std::string& label, const std::string& out) {
    const size_t found = out.find(label);
    EXPECT_NE(found, std::string::npos) << label << "\n" << out;
    return found == std::string::npos ? 0 : std::stod(out.substr(found + label.size()));
  }
};

// From the box's center; the wall starts at 1.2499, which the ball enters at cos(angle) = 0.9999.
constexpr char kGrazedWall[] = "1.7499";
constexpr char kSwingPast[] = "hinge\n-1.5\n-0.5\n0.6\n1.5\n";

TEST_F(Continuous, FindsAGrazeBetweenWaypoints) {
  Ran ran = Check(Swing(kGrazedWall), kSwingPast);
  EXPECT_THAT(ran.out, HasSubstr("# no contact\n"));
  ran = CheckMotion(Swing(kGrazedWall), kSwingPast);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("\n2-3\tCONTACT\twall\tarm\tOVERLAPPING\tseparated until 0.44"));
  EXPECT_THAT(ran.out, HasSubstr("# free 0 contact 1 undecided 0 failed 0\n"));
  EXPECT_THAT(ran.out, HasSubstr("# first contact after waypoint 2 ("));
  EXPECT_THAT(ran.out, HasSubstr("path.csv:3), at 0.44"));
  // acos(0.9999) = 0.014142253475... before the middle, of 1.1.
  const double exact = (0.5 - 0.01414225347512874) / 1.1;
  const double separated_until = NumberAfter("separated until ", ran.out);
  const double contact = NumberAfter("contact at ", ran.out);
  EXPECT_LE(separated_until, exact);
  EXPECT_GE(contact, exact);
  EXPECT_LT(contact - separated_until, 1e-5);
  ran = CheckMotion(Swing(kGrazedWall), kSwingPast, {"--output", "json"});
  EXPECT_THAT(ran.out, HasSubstr("\"event\":\"CONTACT\""));
  EXPECT_THAT(ran.out, HasSubstr("\"firstContact\":{\"separatedUntil\":0.44"));
  EXPECT_THAT(CheckMotion(Swing(kGrazedWall), kSwingPast, {"--output", "name"}).out,
              testing::Eq("2-3\tCONTACT\twall\tarm\tOVERLAPPING\n"));
}

TEST_F(Continuous, ProvesThatATrajectoryIsFree) {
  // 1e-4 from the ball.
  const std::string swing = Swing("1.7501");
  Ran ran = CheckMotion(swing, kSwingPast);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("# free 1 contact 0 undecided 0 failed 0\n"
                                 "# 4 waypoints and the motion between them; free: separated, "
                                 "proven\n# no contact\n"));
  ran = CheckMotion(swing, kSwingPast, {"--clearance", "9.9e-5"});
  EXPECT_THAT(ran.out, HasSubstr("# free 1 near 0 undecided 0 failed 0\n"));
  EXPECT_THAT(ran.out, HasSubstr("free: separated by more than 9.9e-05, proven\n"));
  ran = CheckMotion(swing, kSwingPast, {"--clearance", "1.1e-4"});
  EXPECT_THAT(ran.out, HasSubstr("2-3\tNEAR\twall\tarm\tSEPARATED\tseparated until 0.4"));
  EXPECT_THAT(ran.out, HasSubstr("# free 0 near 1 undecided 0 failed 0\n"));
}

TEST_F(Continuous, DecidesNarrowMissesAndShallowGrazes) {
  // 1e-8 from the ball, and 1e-8 within it.
  EXPECT_THAT(CheckMotion(Swing("1.75000001"), kSwingPast).out, HasSubstr("# free 1 contact 0 "));
  EXPECT_THAT(CheckMotion(Swing("1.74999999"), kSwingPast).out, HasSubstr("# free 0 contact 1 "));
}

TEST_F(Continuous, LeavesAnApproachWithinRoundingUndecided) {
  // 2^-50 from the ball, which is less than the rounding of poses.
  const std::string swing = Swing("1.7500000000000009");
  Ran ran = CheckMotion(swing, kSwingPast);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("\n2-3\tUNDECIDED\twall\tarm\tseparated until 0.4545"));
  EXPECT_THAT(ran.out, HasSubstr("# free 0 contact 0 undecided 1 failed 0\n"));
  EXPECT_THAT(ran.out, HasSubstr("# not decided within 1e-06"));
  EXPECT_THAT(ran.out, Not(HasSubstr("no contact")));
  ran = CheckMotion(swing, kSwingPast, {"--resolution", "1e-3"});
  EXPECT_THAT(ran.out, HasSubstr("# not decided within 0.001"));
}

// Two joints that turn against each other, so that the arm's tip moves on a line that just misses
// or meets a post; both ways are free at all waypoints.
TEST_F(Continuous, FollowsChainsOfJoints) {
  const auto elbow = [](const std::string& x) {
    return R"(<robot name="elbow">
  <link name="post"><collision><origin xyz=")" +
           x + R"( 0 0"/><geometry><box size="0.5 0.25 1"/></geometry></collision></link>
  <joint name="i" type="continuous"><parent link="post"/><child link="upper"/><axis xyz="0 0 1"/></joint>
  <link name="upper"/>
  <joint name="j" type="continuous"><parent link="upper"/><child link="hand"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/></joint>
  <link name="hand"><collision><origin xyz="1 0 0"/><geometry><box size="0.0625 0.0625 1"/></geometry></collision></link>
</robot>)";
  };
  // The hand passes x = 2 cos(i) = 1.53 at i = 0.7, and the post in between at i = 0.
  const std::string path = "i,j\n-1,2\n0.7,-1.4\n1,-2\n";
  Ran ran = CheckMotion(elbow("2.25"), path);
  EXPECT_THAT(ran.out, HasSubstr("1-2\tCONTACT\tpost\thand\t")) << ran.err;
  ran = CheckMotion(elbow("2.5"), path);
  EXPECT_THAT(ran.out, HasSubstr("# free 1 contact 0")) << ran.err;
}

TEST_F(Continuous, AContactAtAWaypointIsFoundThere) {
  const std::string swing = Swing("1.5");
  EXPECT_THAT(CheckMotion(swing, "hinge\n0\n1.5\n").out,
              HasSubstr("1-2\tCONTACT\twall\tarm\tOVERLAPPING\tseparated until 0\tcontact at 0\n"));
  EXPECT_THAT(CheckMotion(swing, "hinge\n0\n0\n").out, HasSubstr("contact at 0\n"));
  // Several turns between two waypoints.
  EXPECT_THAT(CheckMotion(swing, "hinge\n3\n40\n").out, HasSubstr("1-2\tCONTACT\t"));
  EXPECT_THAT(CheckMotion(Swing("1.8"), "hinge\n3\n40\n").out, HasSubstr("# free 1 "));
}

TEST_F(Continuous, ManyWaypointsAreSentInSeveralCalls) {
  std::string path = "hinge\n";
  for (int i = 0; i < 2500; ++i) path += i % 2 == 0 ? "1.5\n" : "1.25\n";
  path += "-1.25\n1.5\n-1.25\n";
  Ran ran = CheckMotion(Swing(kGrazedWall), path);
  EXPECT_THAT(ran.out, HasSubstr("\n2500-2501\tCONTACT\t")) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("path.csv:2501), at 0.49"));
  ran = CheckMotion(Swing(kGrazedWall), path, {"--first"});
  EXPECT_THAT(ran.out, HasSubstr("# first contact after waypoint 2500 ("));
  EXPECT_THAT(ran.out, Not(HasSubstr("# free")));
}

TEST_F(Continuous, AMissingHullOfTheSceneFails) {
  const TempFile scene("lost.yaml", "place:\n  floor: {id: nowhere}\n");
  const Ran ran = CheckMotion(Swing("1.8"), kSwingPast, {"--scene", scene.path()});
  EXPECT_EQ(ran.code, 4);
  EXPECT_THAT(ran.err, HasSubstr("hull \"nowhere\" not found"));
  EXPECT_THAT(ran.out, HasSubstr("# free 1 contact 0 undecided 0 failed 2\n"));
}

TEST_F(Continuous, SurroundingsMustBeAtRest) {
  Put("cube", server::Cube());
  const TempFile scene("cell.yaml", "place:\n  post: {id: cube, at: [-0.5, 1.2499, 0]}\n");
  const Ran ran = CheckMotion(Swing("9"), "hinge\n0\n3\n", {"--scene", scene.path()});
  EXPECT_THAT(ran.out, HasSubstr("1-2\tCONTACT\tarm\tpost\tOVERLAPPING\tseparated until 0.5"))
      << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("# free 2 contact 1 "));
}

TEST_F(Continuous, IncompatibleOptionsAreRefused) {
  const auto error = [&](const std::string& path, std::vector<std::string> more) {
    const Ran ran = CheckMotion(Swing("1.8"), path, std::move(more));
    EXPECT_EQ(ran.code, 2) << ran.out;
    return ran.err;
  };
  EXPECT_THAT(error("hinge\n0\n", {}), HasSubstr("pass at least two with --joints"));
  EXPECT_THAT(error(kSwingPast, {"--separation"}), HasSubstr("--continuous finds first contacts"));
  EXPECT_THAT(error(kSwingPast, {"--tolerance", "0.1"}), HasSubstr("not with --tolerance"));
  EXPECT_THAT(error("hinge\n0\n1e300\n", {}), HasSubstr("between waypoints 1 and 2; add"));
  EXPECT_EQ(Check(Swing("1.8"), kSwingPast, {"--resolution", "1"}).code, 2);
}

}  // namespace continuous_check_test
}  // namespace hulld
