// Queries about files, and hullctl's private servers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/local/local_server.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace files_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Files : public HullctlOnServer {
 protected:
  void SetUp() override {
    HullctlOnServer::SetUp();
    std::string pattern = (fs::temp_directory_path() / "hullctl-files-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    fs::remove_all(folder_);
    HullctlOnServer::TearDown();
  }

  // Writes points as a file; returns its path.
  std::string Write(const std::string& name, const server::Coordinates& xyz) const {
    const fs::path path = folder_ / name;
    std::ofstream out(path);
    out.precision(17);
    for (size_t i = 0; i < xyz.size(); i += 3) {
      out << xyz[i] << " " << xyz[i + 1] << " " << xyz[i + 2] << "\n";
    }
    return path.string();
  }

  bool StoresNothing() const {
    const auto hulls = Client({}, channel_).ListAllHulls("");
    return hulls.ok() && hulls->hulls().empty();
  }

  fs::path folder_;
};

TEST_F(Files, AreCheckedWithoutBeingStored) {
  const std::string cube = Write("cube.xyz", server::Cube());
  const Ran ran = Run({"check", cube, cube, "--pose-b", "1,0,0"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("TOUCHING"));
  EXPECT_THAT(ran.out, HasSubstr(cube + "  (8 points)"));
  EXPECT_TRUE(StoresNothing());
}

TEST_F(Files, CollideWithHullsAndAreVerified) {
  Put("ball", server::Sphere(300));
  const std::string cube = Write("cube.xyz", server::Cube());
  for (const char* const pose : {"0,0,0", "1,0,0", "3,0,0"}) {
    const Ran ran = Run({"check", "ball", cube, "--pose-b", pose, "--verify"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("valid"));
  }
  ASSERT_EQ(Run({"body", "put", "pair", "ball", "ball@5,0,0"}).code, 0);
  const Ran body = Run({"check", "pair", cube, "--pose-b", "1,0,0", "--verify"});
  EXPECT_EQ(body.code, 0) << body.err;
  const std::string record = (folder_ / "answer.json").string();
  ASSERT_EQ(Run({"check", cube, "ball", "--record", record}).code, 0);
  EXPECT_EQ(Run({"verify", record}).code, 0);
  EXPECT_EQ(Run({"check", cube, "ball", "--textbook", "--axis"}).code, 0);
}

TEST_F(Files, HaveRadii) {
  Put("cube", server::Cube());
  const std::string center = Write("center.xyz", {0, 0, 0});
  const auto check = [&](const std::string& radius) {
    return Run({"check", "cube", center, "--pose-b", "4,5,0.5", "--radius-a", "2", "--radius-b",
                radius, "--verify"});
  };
  const Ran touching = check("3");
  EXPECT_EQ(touching.code, 0) << touching.err;
  EXPECT_THAT(touching.out, HasSubstr("TOUCHING"));
  EXPECT_THAT(touching.out, HasSubstr(", radius 2\n"));
  EXPECT_THAT(touching.out, HasSubstr("(1 point), radius 3\n"));
  EXPECT_THAT(touching.out, HasSubstr("valid"));
  EXPECT_THAT(check("2.9999999999999996").out, HasSubstr("SEPARATED"));
  EXPECT_THAT(check("3.0000000000000004").out, HasSubstr("OVERLAPPING"));
  EXPECT_THAT(check("-1").err, HasSubstr("\"-1\" is not a length of at least 0"));
  const std::string record = (folder_ / "rounded.json").string();
  ASSERT_EQ(Run({"check", "cube", center, "--radius-b", "1", "--record", record}).code, 0);
  EXPECT_EQ(Run({"verify", record}).code, 0);
}

TEST_F(Files, PiecesHaveRadii) {
  Put("cube", server::Cube());
  const std::string center = Write("center.xyz", {0, 0, 0});
  ASSERT_EQ(Run({"body", "put", "row", "cube", "cube@4,0,0:0.25"}).code, 0);
  EXPECT_THAT(Run({"body", "get", "row"}).out, HasSubstr("1      cube  4,0,0  0.25\n"));
  const Ran ran = Run({"check", "row", center, "--pose-b", "6,0.5,0.5", "--radius-a", "0.25",
                       "--radius-b", "0.5", "--verify"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("TOUCHING"));
  EXPECT_THAT(ran.out, HasSubstr("piece of A   1: cube"));
  EXPECT_THAT(Run({"body", "put", "row", "cube:wide"}).err,
              HasSubstr("\"cube:wide\": the radius after the colon is not a length"));
  EXPECT_THAT(Run({"body", "put", "row", ":1"}).err, HasSubstr("names no hull"));
}

TEST_F(Files, OfManyPointsSendTheirVertices) {
  server::Coordinates cloud = server::Cube(-2, 4);
  const server::Coordinates inside = server::Sphere(5000);
  cloud.insert(cloud.end(), inside.begin(), inside.end());
  const std::string file = Write("cloud.xyz", cloud);
  const Ran ran = Run({"check", file, file, "--pose-b", "4,0,0"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("TOUCHING"));
  EXPECT_THAT(ran.out, HasSubstr("(8 points)"));
  EXPECT_TRUE(StoresNothing());
}

TEST_F(Files, OfManyVerticesNeedALocalServer) {
  const std::string file = Write("ball.xyz", server::Sphere(5000));
  const Ran refused = Run({"check", file, file});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("ball.xyz: its hull has 5000 vertices"));
  EXPECT_THAT(refused.err, HasSubstr("use --local"));
  const Ran local = RunTool({"check", file, file, "--local", "--output", "name"});
  EXPECT_EQ(local.code, 0) << local.err;
  EXPECT_EQ(local.out, "OVERLAPPING\n");
}

TEST_F(Files, OfScenesDefineTheHullsOfALocalServer) {
  const std::string path = (folder_ / "scene.yaml").string();
  std::ofstream(path) << "hulls: {box: {points: [[0,0,0], [1,0,0], [0,1,0], [0,0,1]]}}\n"
                         "bodies: {pair: [{hull: box}, {hull: box, at: [5, 0, 0]}]}\n"
                         "place: {a: {hull: box}, b: {body: pair, at: [-5, 0, 0]}}\n";
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"scene"}, {"scene", "check"}, {"batch"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {path, "--local", "--output", "name"});
    const Ran ran = RunTool(arguments);
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("a\tb\tOVERLAPPING"));
  }
}

TEST_F(Files, AreNamedInErrors) {
  EXPECT_THAT(Run({"check", "./part", "./part"}).err, HasSubstr("./part"));
  EXPECT_THAT(Run({"check", (folder_ / "none.stl").string(), "a"}).err, HasSubstr("none.stl"));
  const std::string empty = Write("empty.xyz", {});
  EXPECT_THAT(Run({"check", empty, empty}).err, HasSubstr("empty.xyz: contains no points"));
  // A name without a matching file is an ID.
  EXPECT_THAT(Run({"check", "part.stl", "part.stl"}).err, HasSubstr("part.stl"));
}

TEST(Local, NeedsNoServer) {
  const Ran ran = RunTool({"--local", "status"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("unix:"));
  const Ran both = RunTool({"--local", "status", "--server", "127.0.0.1:1"});
  EXPECT_EQ(both.code, 2);
  EXPECT_THAT(both.err, HasSubstr("--local starts a server of its own; remove --server"));
}

TEST(Local, NamesAMissingProgram) {
  setenv("HULLD_BINARY", "/nonexistent/hulld", 1);
  const Ran ran = RunTool({"--local", "status"});
  unsetenv("HULLD_BINARY");
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("HULLD_BINARY is /nonexistent/hulld"));
}

TEST(Local, RemovesItsFolder) {
  auto server = LocalServer::Start();
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string address = (*server)->address();
  ASSERT_THAT(address, StartsWith("unix:/"));
  const fs::path folder = fs::path(address.substr(5)).parent_path();
  EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
  server->reset();
  EXPECT_FALSE(fs::exists(folder));
}

// A process that is killed cannot clean up.
TEST(Local, EndsWithItsProcess) {
  std::array<int, 2> pipe_ends;
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto server = LocalServer::Start();
    const std::string address = server.ok() ? (*server)->address() : "";
    const auto written = write(pipe_ends[1], address.data(), address.size());
    _exit(written > 0 && raise(SIGKILL) == 0 ? 0 : 1);
  }
  close(pipe_ends[1]);
  std::string address(4096, '\0');
  const ssize_t size = read(pipe_ends[0], address.data(), address.size());
  close(pipe_ends[0]);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_GT(size, 5);
  const fs::path folder = fs::path(address.substr(5, static_cast<size_t>(size) - 5)).parent_path();
  // Bounded by the test's time limit only.
  while (fs::exists(folder)) {
  }
}

}  // namespace files_test
}  // namespace hulld
