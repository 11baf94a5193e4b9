// Write commands with empty input, or with a missing target.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace safe_writes_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class SafeWrites : public HullctlOnServer {
 protected:
  bool Exists(const std::string& hull_id) { return Run({"get", hull_id}).code == 0; }
};

TEST_F(SafeWrites, ReplacingWithNoPointsMustBeExplicit) {
  Put("h", server::Cube());
  const TempFile empty("empty.xyz", "");
  const TempFile only_nan("nan.xyz", "nan 0 0\n");
  for (const std::vector<std::string>& files :
       {std::vector<std::string>{empty.path()}, {empty.path(), empty.path()}, {only_nan.path()}}) {
    std::vector<std::string> command = {"replace", "h", "--skip-nonfinite"};
    command.insert(command.end(), files.begin(), files.end());
    const Ran ran = Run(command);
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, AllOf(HasSubstr("no points in " + files[0]), HasSubstr("--allow-empty")));
    EXPECT_EQ(Get("h").hull().vertex_count(), 8U);
  }
  EXPECT_EQ(Run({"replace", "new", empty.path(), "--create"}).code, 2);
  EXPECT_FALSE(Exists("new"));
  const TempFile good("good.xyz", "9 9 9\n");
  EXPECT_THAT(Run({"replace", "h", good.path(), empty.path()}).err,
              HasSubstr("no points in " + empty.path() + ";"));
  EXPECT_EQ(Get("h").hull().vertex_count(), 8U);
  EXPECT_EQ(Run({"replace", "h", good.path(), empty.path(), "--allow-empty"}).code, 0);
  EXPECT_EQ(Get("h").hull().vertex_count(), 1U);
  EXPECT_EQ(Run({"replace", "h", empty.path(), "--allow-empty"}).code, 0);
  EXPECT_EQ(Get("h").hull().vertex_count(), 0U);
}

TEST_F(SafeWrites, AppendCreatesNoHullFromARefusedFile) {
  const TempFile malformed("a.xyz", "1 2 x\n");
  const TempFile nan("b.xyz", "nan 1 2\n");
  for (const TempFile* file : {&malformed, &nan}) {
    const Ran ran = Run({"append", "new", file->path(), "--create"});
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, HasSubstr(file->path() + ":1: "));
    EXPECT_EQ(ran.out, "");
    EXPECT_FALSE(Exists("new"));
  }
}

TEST_F(SafeWrites, AppendNamesDirectoriesAndMissingFilesOfAnyExtension) {
  EXPECT_EQ(Run({"append", "new", testing::TempDir(), "--create"}).err,
            "hullctl: " + testing::TempDir() + " is a directory; pass a file\n");
  EXPECT_THAT(Run({"append", "new", "/no/such/file", "--create"}).err,
              HasSubstr("cannot open /no/such/file: No such file"));
}

TEST_F(SafeWrites, AppendRefusesAFileWithoutPoints) {
  Put("h", server::Cube());
  const TempFile good("good.xyz", "9 9 9\n");
  for (const char* name : {"empty.xyz", "empty.csv"}) {
    const TempFile empty(name, "# nothing\n");
    const std::string error = "hullctl: " + empty.path() + ": contains no points\n";
    Ran ran = Run({"append", "new", empty.path(), "--create"});
    EXPECT_EQ(ran.code, 2);
    EXPECT_EQ(ran.err, error);
    EXPECT_FALSE(Exists("new"));
    ran = Run({"append", "h", empty.path()});
    EXPECT_EQ(ran.code, 2);
    EXPECT_EQ(ran.err, error);
    ran = Run({"append", "h", good.path(), empty.path()});
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, AllOf(HasSubstr("appended 1 point before"), HasSubstr(error)));
  }
}

TEST_F(SafeWrites, AppendCreatesNoHullFromSkippedPoints) {
  const TempFile holes("holes.xyz", "0 0 0\n");
  const Ran ran = Run({"append", "new", holes.path(), "--create", "--skip-zero"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("contain no points"), HasSubstr("hullctl create")));
  EXPECT_FALSE(Exists("new"));
  Put("h", server::Cube());
  EXPECT_EQ(Run({"append", "h", holes.path(), "--skip-zero"}).code, 0);
}

TEST_F(SafeWrites, AppendRemovesTheHullThatItCreatedWhenTheServerRefusesItsPoints) {
  server::Config config = TestConfig();
  config.limits.max_points_per_chunk = 3;
  Restart(config);
  const TempFile file("a.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
  Ran ran = Run({"append", "new", file.path(), "--create"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("the limit is 3"));
  EXPECT_FALSE(Exists("new"));
  // A hull that existed before is kept, even if empty.
  Create("mine");
  EXPECT_EQ(Run({"append", "mine", file.path(), "--create"}).code, 1);
  EXPECT_TRUE(Exists("mine"));
  // So do accepted points.
  ran = Run({"append", "some", "--create", "--chunk-points", "2", file.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(Get("some").hull().vertex_count(), 4U);
}

TEST_F(SafeWrites, NotFoundErrorsDoNotSuggestCreatingTheHull) {
  const Ran ran = Run({"delete", "nope"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("hull \"nope\" not found"), Not(HasSubstr("create"))));
  const TempFile file("scene", "place: {a: {id: nope}, b: {id: nope}}\n");
  EXPECT_THAT(Run({"batch", file.path()}).out,
              AllOf(HasSubstr("hull \"nope\" not found"), Not(HasSubstr("create"))));
}

}  // namespace safe_writes_test
}  // namespace hulld
