// list with its orders and counts, and delete of several.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace list_and_delete_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ListAndDelete : public HullctlOnServer {
 protected:
  void SetUp() override {
    HullctlOnServer::SetUp();
    Put("arm/1", server::Cube());
    Put("arm/2", server::Sphere(20));
    Put("box", {0, 0, 0, 1, 1, 1});
  }

  std::string Names(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--output", "name"});
    return Run(arguments).out;
  }
};

TEST_F(ListAndDelete, ListsAreSortedAndLimited) {
  EXPECT_EQ(Names({"list"}), "arm/1\narm/2\nbox\n");
  EXPECT_EQ(Names({"list", "--reverse"}), "box\narm/2\narm/1\n");
  EXPECT_EQ(Names({"list", "--sort", "vertices"}), "arm/2\narm/1\nbox\n");
  EXPECT_EQ(Names({"list", "--sort", "revision"}), "box\narm/2\narm/1\n");
  EXPECT_EQ(Names({"list", "arm/", "--sort", "points", "--reverse"}), "arm/1\narm/2\n");
  const Ran first = Run({"list", "--sort", "vertices", "--limit", "1"});
  EXPECT_THAT(first.out, HasSubstr("arm/2"));
  EXPECT_THAT(first.err, HasSubstr("there are more hulls"));
  EXPECT_THAT(Run({"list", "--output", "wide"}).out, AllOf(HasSubstr("CREATED"), HasSubstr("ok")));
}

TEST_F(ListAndDelete, CountsAreOfAll) {
  EXPECT_EQ(Run({"list", "--count"}).out, "hulls     3\nvertices  30\npoints    30\n");
  EXPECT_EQ(RunJson({"list", "arm/", "--count"}).out,
            "{\"hulls\":\"2\",\"vertices\":\"28\",\"points\":\"28\",\"bodies\":\"0\"}\n");
  ASSERT_EQ(Run({"body", "put", "arm/body", "box"}).code, 0);
  EXPECT_EQ(Run({"list", "--count"}).out, "hulls     3\nvertices  30\npoints    30\nbodies    1\n");
  EXPECT_EQ(Run({"list", "b", "--count"}).out, "hulls     1\nvertices  2\npoints    2\n");
}

TEST_F(ListAndDelete, SeveralAreDeletedOnlyWithConfirmation) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"delete", "arm/1", "box"}, {"delete", "--prefix", "arm/"}}) {
    const Ran ran = Run(words);
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, AllOf(HasSubstr("2 hulls (arm/1, "), HasSubstr("--yes")));
  }
  EXPECT_EQ(Names({"list"}), "arm/1\narm/2\nbox\n");
  EXPECT_EQ(Names({"delete", "--prefix", "arm/", "--yes"}), "arm/1\narm/2\n");
  EXPECT_EQ(Names({"list"}), "box\n");
  const Ran none = Run({"delete", "--prefix", "arm/", "--yes"});
  EXPECT_EQ(none.code, 0);
  EXPECT_THAT(none.err, HasSubstr("no hull ID starts with \"arm/\""));
}

TEST_F(ListAndDelete, AMissingHullDoesNotPreventOtherDeletions) {
  const Ran ran = Run({"delete", "arm/1", "nope", "box", "arm/1", "--yes"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("\"nope\" not found"), HasSubstr("deleted 2 of 3 hulls")));
  EXPECT_EQ(Names({"list"}), "arm/2\n");
  EXPECT_EQ(Run({"delete", "nope", "--if-exists"}).code, 0);
  EXPECT_EQ(RunJson({"delete", "arm/2"}).code, 0);
}

TEST_F(ListAndDelete, ContradictoryArgumentsAreExplained) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"delete"},
        {"delete", "box", "--prefix", "arm/"},
        {"delete", "--prefix", "", "--yes"},
        {"delete", "box", "arm/1", "--if-revision", "3", "--yes"}}) {
    const Ran ran = Run(words);
    EXPECT_EQ(ran.code, 2);
    EXPECT_NE(ran.err, "");
  }
  EXPECT_EQ(Names({"list"}), "arm/1\narm/2\nbox\n");
}

}  // namespace list_and_delete_test
}  // namespace hulld
