// --max-staleness and --at-least: the commands that accept them, and their transmission with each
// read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace freshness_options_test {

using ::testing::HasSubstr;

class FreshnessOptions : public HullctlOnServer {
 protected:
  void SetUp() override {
    HullctlOnServer::SetUp();
    Put("cube", server::Cube());
    ASSERT_EQ(Run({"body", "put", "body", "cube"}).code, 0);
  }

  static std::string WriteFile(const std::string& name, const std::string& text) {
    const std::string path = ::testing::TempDir() + "freshness_options_" + name;
    std::ofstream(path) << text;
    return path;
  }

  // All commands that read.
  const std::vector<std::vector<std::string>> reads_ = {
      {"get", "cube"},
      {"list"},
      {"mesh", "cube"},
      {"check", "cube", "body"},
      {"batch", WriteFile("pairs.json", R"({"placements":[{"hullId":"cube"},{"hullId":"body"}],)"
                                        R"("pairs":[0,1]})")},
      {"scene", WriteFile("scene.json", R"({"placements":[{"hullId":"cube"},{"hullId":"body"}]})")},
      {"stream", WriteFile("stream.json", R"({"placements":[{"hullId":"cube"},{"hullId":"body"}],)"
                                          R"("pairs":[0,1]})")},
      {"body", "get", "body"},
      {"body", "list"},
      {"bench", "load", "--requests", "1", "--hulls", "1"}};

  Ran ReadWith(std::vector<std::string> read, const std::vector<std::string>& options) {
    read.insert(read.end(), options.begin(), options.end());
    return Run(read);
  }
};

TEST_F(FreshnessOptions, EachReadCarriesThem) {
  const auto hull = MessagesIn<v1::GetHullResponse>(RunJson({"get", "cube"}).out);
  ASSERT_EQ(hull.size(), 1);
  const v1::ResponseHeader& header = hull.front().header();
  for (const std::vector<std::string>& read : reads_) {
    const Ran fresh = ReadWith(read, {"--max-staleness", "200ms", "--at-least",
                                      header.store_id() + ":" + std::to_string(header.revision())});
    EXPECT_EQ(fresh.code, 0) << read.front() << ": " << fresh.err;
    const Ran other = ReadWith(read, {"--at-least", "another:1"});
    EXPECT_EQ(other.code, 1) << read.front();
    EXPECT_THAT(other.out + other.err, HasSubstr("differs from this store's ID")) << read.front();
  }
  const Ran future = Run({"get", "cube", "--at-least", header.store_id() + ":1000"});
  EXPECT_EQ(future.code, 1);
  EXPECT_THAT(future.err, HasSubstr("at_least_revision is 1000"));
}

TEST_F(FreshnessOptions, MalformedTimesAndRevisionsAreRefused) {
  for (const char* const text : {"7", "store:", ":7", "store:x", "store:-1"}) {
    const Ran ran = Run({"get", "cube", "--at-least", text});
    EXPECT_EQ(ran.code, 2) << text;
    EXPECT_THAT(ran.err, HasSubstr("is not STORE:REVISION")) << text;
  }
  EXPECT_EQ(Run({"get", "cube", "--max-staleness", "-1s"}).code, 2);
  EXPECT_EQ(Run({"delete", "cube", "--max-staleness", "1s"}).code, 2);
}

}  // namespace freshness_options_test
}  // namespace hulld
