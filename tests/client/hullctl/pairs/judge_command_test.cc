// hullctl judge: another program's answers against exact ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tests/client/hullctl/pairs/cube_server.h"

namespace hulld {
namespace judge_command_test {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Judge : public CubeServer {
 protected:
  Ran JudgeText(const std::string& table, std::vector<std::string> options = {}) {
    options.insert(options.begin(), {"judge", Write("answers.csv", table)});
    return Run(std::move(options));
  }

  static std::vector<std::string> Lines(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }
};

TEST_F(Judge, RightAnswersPass) {
  const Ran ran = JudgeText(
      "a,b,b_x,relation,distance,depth\n"
      "cube,cube,3,SEPARATED,2,0\n"
      "cube,cube,1,touching,0,0\n"
      "cube,cube,0.5,OVERLAPPING,0,0.5\n"
      "cube,cube,0.5,,-0.5,\n",
      {"--max-error", "1e-12"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, StartsWith("# 4 answers, 0 wrong, 0 failed\n"));
}

TEST_F(Judge, WrongAnswersComeWorstFirstWithTheirProof) {
  const Ran ran = JudgeText(
      "a,b,b_x,relation,distance\n"
      "cube,cube,3,SEPARATED,2.25\n"
      "cube,cube,2,OVERLAPPING,\n"
      "cube,cube,1,SEPARATED,0\n"
      "cube,cube,0.25,SEPARATED,0\n"
      "cube,cube,0.5,TOUCHING,0\n");
  EXPECT_EQ(ran.code, 1);
  const std::vector<std::string> lines = Lines(ran.out);
  ASSERT_EQ(lines.size(), 8u) << ran.out;
  EXPECT_THAT(lines[0], StartsWith("line 3\tcube\tcube\tfalse contact\toff by 1\tSEPARATED\t1 "));
  EXPECT_THAT(lines[1], StartsWith("line 5\tcube\tcube\tmiss\toff by 0.75\tOVERLAPPING\t-0.75"));
  EXPECT_THAT(lines[2], HasSubstr("line 6\tcube\tcube\ttouching\toff by 0.5"));
  EXPECT_THAT(lines[3], HasSubstr("line 2\tcube\tcube\tdistance\toff by 0.25\tSEPARATED\t2 "));
  EXPECT_THAT(lines[4], HasSubstr("line 4\tcube\tcube\ttouching\toff by 0\tTOUCHING"));
  for (size_t i = 0; i < 5; ++i) EXPECT_THAT(lines[i], EndsWith("\tvalid"));
  EXPECT_EQ(lines[5], "# 5 answers, 5 wrong, 0 failed");
  EXPECT_EQ(lines[6], "# false contact 1, miss 1, touching 2, distance 1, depth 0, time 0");
  EXPECT_THAT(lines[7], StartsWith("# largest error of a distance 0.25"));
}

TEST_F(Judge, AProgramThatReportsOnlyCollisionsMayReportTouchingEitherWay) {
  const Ran ran = JudgeText(
      "a b b_x colliding\ncube cube 1 1\ncube cube 1 0\ncube cube 0.5 true\ncube cube 2 false\n");
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.out, StartsWith("line 3\tcube\tcube\ttouching\t"));
  EXPECT_THAT(ran.out, HasSubstr("# 4 answers, 1 wrong"));
}

TEST_F(Judge, JsonLinesAreRecordsForVerify) {
  const std::string shape = Write("tetrahedron.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
  const Ran ran = JudgeText("a;b;b_qw;b_qx;b_qy;b_qz;b_x;relation;solver\n" + shape +
                                ";cube;0;0;0;2;3;OVERLAPPING;fast\n",
                            {"--output", "json"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("ignored columns: solver"));
  const std::vector<std::string> lines = Lines(ran.out);
  ASSERT_EQ(lines.size(), 2u) << ran.out;
  EXPECT_THAT(lines[0], StartsWith("{\"line\":\"2\",\"fault\":\"false contact\",\"error\":1"));
  EXPECT_THAT(lines[1], StartsWith("{\"answers\":\"1\",\"wrong\":\"1\",\"falseContacts\":\"1\""));
  const Ran verified = Run({"verify", Write("record.json", lines[0])});
  EXPECT_EQ(verified.out, "SEPARATED: valid\n");
  EXPECT_THAT(Lines(JudgeText("a,b,b_x,colliding\ncube,cube,9,1\n", {"--output", "name"}).out),
              ElementsAre("2"));
}

// The answers of a box test in floats that grows its boxes by a margin, as physics engines do.
TEST_F(Judge, FindsTheErrorsOfAFloatBoxTestWithAMargin) {
  constexpr float kMargin = 0.04F;
  std::mt19937 random(11);
  std::uniform_int_distribution<int> steps(-48, 48);
  std::string table = "a,b,b_x,b_y,b_z,colliding,distance\n";
  int false_contacts = 0;
  double largest = 0;
  for (int i = 0; i < 300; ++i) {
    std::array<double, 3> gap;
    std::string row = "cube,cube";
    float squared = 0;
    double exact_squared = 0;
    for (double& one : gap) {
      const double place = steps(random) / 32.0;
      row += "," + std::to_string(place);
      one = std::max(std::abs(place) - 1, 0.0);
      exact_squared += one * one;
      const float with_margin = std::max(static_cast<float>(one) - kMargin, 0.0F);
      squared += with_margin * with_margin;
    }
    const bool claims_contact = squared == 0;
    const double distance = std::sqrt(squared);
    false_contacts += claims_contact && exact_squared > 0;
    largest = std::max(largest, std::abs(distance - std::sqrt(exact_squared)));
    std::ostringstream text;
    text.precision(17);
    text << row << "," << claims_contact << "," << distance << "\n";
    table += text.str();
  }
  ASSERT_GT(false_contacts, 3);
  const Ran ran = JudgeText(table, {"--max-error", "0.1"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.out, HasSubstr("# 300 answers, " + std::to_string(false_contacts) + " wrong"));
  EXPECT_THAT(ran.out, HasSubstr("# false contact " + std::to_string(false_contacts) +
                                 ", miss 0, touching 0, distance 0, depth 0, time 0"));
  const std::string reported = ran.out.substr(ran.out.find("of a distance ") + 14);
  EXPECT_NEAR(std::stod(reported), largest, 1e-9);
}

TEST_F(Judge, OnlyPairsWithoutAnAnswerFail) {
  const Ran ran = JudgeText("a,b,colliding\ncube,absent,1\ncube,cube,1\n");
  EXPECT_EQ(ran.code, 4);
  EXPECT_THAT(ran.err, HasSubstr("line 2: hull \"absent\" not found"));
  EXPECT_THAT(ran.out, StartsWith("# 2 answers, 0 wrong, 1 failed\n"));
}

TEST_F(Judge, ErrorsNameLineAndColumn) {
  const auto error = [this](const std::string& table, const std::string& what) {
    const Ran ran = JudgeText(table);
    EXPECT_EQ(ran.code, 2) << table;
    EXPECT_THAT(ran.err, HasSubstr(what)) << table;
  };
  error("", "the table contains no answers");
  error("a,b,colliding\n", "the table contains no answers");
  error("a,colliding\n", "answers.csv:1: the header has no column b");
  error("a,b,b_x\n", "needs relation, colliding, distance, depth, or contact_time");
  error("a,b,colliding,A\n", "the header names \"a\" twice");
  error("a,b,b_qw,colliding\n", "a quaternion has four columns: b_qw b_qx b_qy b_qz");
  error("a,b,colliding\ncube,cube\n", "answers.csv:2: the row has 2 cells, but the header has 3");
  error("a,b,colliding\ncube,,1\n", "answers.csv:2: b is empty");
  error("a,b,colliding\ncube,cube,yes\n", "colliding: \"yes\" is not one of 0, 1, false, true");
  error("a,b,relation\ncube,cube,NEAR\n",
        "\"NEAR\" is not one of SEPARATED, TOUCHING, OVERLAPPING");
  error("a,b,distance\ncube,cube,far\n", "distance: \"far\" is not a number");
  error("a,b,distance\ncube,cube,nan\n", "leave the cell empty");
  error("a,b,depth\ncube,cube,-1\n", "depth: -1 is not a depth");
  error("a,b,b_x,depth\ncube,cube,inf,1\n", "b_x: inf is not finite");
  error("a,b,b_qw,b_qx,b_qy,b_qz,depth\ncube,cube,0,0,0,0,1\n", "are all 0");
  error("a,b,b_to_qw,colliding\n", "a quaternion has four columns: b_to_qw b_to_qx");
  error("a,b,b_to_qw,b_to_qx,b_to_qy,b_to_qz,colliding\ncube,cube,0,0,0,0,1\n",
        "b_to_qw, b_to_qx, b_to_qy, b_to_qz are all 0");
  error("a,b,b_to_x,contact_time\ncube,cube,1,1.5\n", "1.5 is not a time from 0 to 1");
  error("a,b,b_to_x,contact_time\ncube,cube,,0.5\n", "contact_time needs a motion");
  error("a,b,b_to_x,distance\ncube,cube,1,0.5\n", "distance and depth apply only to pairs at rest");
  error("a,b,us,distance\ncube,cube,-1,0.5\n", "us: -1 is not a duration of at least 0");
}

// Cubes approach along x by 2 from gaps of 1 and of 3.
TEST_F(Judge, TimesOfContactAreJudgedAgainstTheProvenBracket) {
  const std::string table =
      "a,b,b_x,b_to_x,colliding,contact_time\n"
      "cube,cube,2,0,1,0.5\n"
      "cube,cube,2,0,1,0.5625\n"
      "cube,cube,2,0,1,0.25\n"
      "cube,cube,2,0,0,\n"
      "cube,cube,4,2,0,\n"
      "cube,cube,4,2,1,0.875\n"
      "cube,cube,0.5,,1,\n";
  const Ran ran = JudgeText(table);
  EXPECT_EQ(ran.code, 1) << ran.err;
  const std::vector<std::string> lines = Lines(ran.out);
  ASSERT_EQ(lines.size(), 7u) << ran.out;
  EXPECT_THAT(lines[0], StartsWith("line 5\tcube\tcube\tmiss\toff by 0.5\tOVERLAPPING\t"));
  EXPECT_THAT(lines[1], StartsWith("line 4\tcube\tcube\ttime\toff by 0.25\t"));
  EXPECT_THAT(lines[2], StartsWith("line 7\tcube\tcube\tfalse contact\toff by 0.125\tSEPARATED"));
  EXPECT_THAT(lines[3], StartsWith("line 3\tcube\tcube\ttime\toff by 0.0625\t"));
  for (size_t i = 0; i < 4; ++i) EXPECT_THAT(lines[i], EndsWith("\tvalid"));
  EXPECT_EQ(lines[4], "# 7 answers, 4 wrong, 0 failed");
  EXPECT_EQ(lines[5], "# false contact 1, miss 1, touching 0, distance 0, depth 0, time 2");
  EXPECT_THAT(lines[6], EndsWith(", of a time 0.25"));
  EXPECT_THAT(JudgeText(table, {"--max-time-error", "0.1"}).out, HasSubstr("3 wrong"));
  const std::string record = Lines(JudgeText(table, {"--output", "json"}).out)[0];
  EXPECT_EQ(Run({"verify", Write("record.json", record)}).out, "OVERLAPPING: valid\n");
}

TEST_F(Judge, ThePlotShowsTheProgramNextToTheServer) {
  const std::string table = "a,b,b_x,distance,us\ncube,cube,3,2.25,12\ncube,cube,4,3,8\n";
  const std::string chart = Write("trade.svg", "");
  const Ran ran = JudgeText(table, {"--plot", chart});
  if (ran.err.find("needs gnuplot") != std::string::npos) GTEST_SKIP() << ran.err;
  EXPECT_EQ(ran.code, 1) << ran.err;
  std::ostringstream svg;
  svg << std::ifstream(chart).rdbuf();
  EXPECT_THAT(svg.str(), HasSubstr("the program, 50% wrong"));
  EXPECT_THAT(svg.str(), HasSubstr("hulld, proven bound"));
  EXPECT_THAT(JudgeText("a,b,b_x,distance\ncube,cube,3,2\n", {"--plot", chart}).err,
              HasSubstr("--plot needs pairs at rest and a column us"));
}

}  // namespace judge_command_test
}  // namespace hulld
