#include "client/hullctl/completion/completion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace completion_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

class CompletionOnServer : public HullctlOnServer {
 protected:
  // Returns the candidates for the last word, and the directive at the end.
  std::vector<std::string> Offers(std::vector<std::string> words) {
    words.insert(words.begin(), {kCompleteCommand, "--server", server_->address()});
    const Ran ran = RunTool(words);
    EXPECT_EQ(ran.code, 0);
    EXPECT_EQ(ran.err, "");
    std::vector<std::string> offers;
    std::istringstream lines(ran.out);
    for (std::string line; std::getline(lines, line);) {
      offers.push_back(line.substr(0, line.find('\t')));
    }
    return offers;
  }
};

TEST_F(CompletionOnServer, CommandsOptionsAndValuesComeFromTheDeclaration) {
  EXPECT_THAT(Offers({"ch"}), ElementsAre("check", ":"));
  EXPECT_THAT(Offers({"backup", ""}), ElementsAre("save", "restore", ":"));
  EXPECT_THAT(Offers({"check", "a", "b", "--wit"}), ElementsAre("--witness", ":"));
  EXPECT_THAT(Offers({"check", "a", "b", "--witness", "--wit"}), ElementsAre(":"));
  EXPECT_THAT(Offers({"list", "--output", "j"}), ElementsAre("json", ":"));
  EXPECT_THAT(Offers({"list", "--output=j"}), ElementsAre("--output=json", ":"));
  EXPECT_THAT(Offers({"--color", "never", "generate", "b"}), ElementsAre("ball", ":"));
  EXPECT_THAT(Offers({"append", "a", ""}), ElementsAre(":files"));
  EXPECT_THAT(Offers({"mesh", "a", "-o", ""}), ElementsAre(":files"));
  EXPECT_THAT(Offers({"backup", "restore", "f", "--data-dir", ""}), ElementsAre(":directories"));
  // No hidden options, and no candidates if no more words fit.
  EXPECT_THAT(Offers({"__"}), ElementsAre(":"));
  EXPECT_THAT(Offers({"create", "a", ""}), ElementsAre(":"));
  EXPECT_THAT(Offers({"nonsense", "--out"}), ElementsAre("--output", ":"));
}

TEST_F(CompletionOnServer, IdsOfHullsComeFromTheServer) {
  Create("arm/1");
  Create("arm/2");
  Create("box");
  EXPECT_THAT(Offers({"get", ""}), ElementsAre("arm/1", "arm/2", "box", ":"));
  EXPECT_THAT(Offers({"check", "box", "arm"}), ElementsAre("arm/1", "arm/2", ":files"));
  EXPECT_THAT(Offers({"delete", "box", "b"}), ElementsAre("box", ":"));
  EXPECT_THAT(Offers({"create", ""}), ElementsAre(":"));
  // Many IDs are completed by segments.
  for (int i = 0; i < 100; ++i) Create("arm/" + std::to_string(i) + "/hand");
  EXPECT_THAT(Offers({"get", "arm/9"}).size(), 12U);
  const std::vector<std::string> parts = Offers({"list", "a"});
  EXPECT_THAT(parts, ElementsAre("arm/", ":"));
}

TEST_F(CompletionOnServer, BodiesAreOfferedWhereTheyAreAccepted) {
  Create("bolt");
  ASSERT_EQ(RunTool({"body", "put", "bracket", "bolt", "--server", server_->address()}).code, 0);
  EXPECT_THAT(Offers({"check", "b"}), ElementsAre("bolt", "bracket", ":files"));
  EXPECT_THAT(Offers({"view", "b"}), ElementsAre("bolt", "bracket", ":files"));
  EXPECT_THAT(Offers({"body", "get", ""}), ElementsAre("bracket", ":"));
  EXPECT_THAT(Offers({"get", "b"}), ElementsAre("bolt", ":"));
}

TEST_F(CompletionOnServer, FailuresAreSilent) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--server", "127.0.0.1:1", "get", ""},
        {"--server", "nonsense", "get", ""},
        {"--ca-cert", "/no/such/file", "get", ""},
        {"--context", "nope", "get", ""}}) {
    EXPECT_THAT(Offers(words), ElementsAre(":"));
  }
  EXPECT_EQ(RunTool({kCompleteCommand}).out, ":\n");
}

TEST(CompletionScript, CallsTheProgramThatIsTyped) {
  for (const char* shell : {"bash", "zsh", "fish"}) {
    const Ran ran = RunTool({"completion", shell});
    EXPECT_EQ(ran.code, 0);
    EXPECT_THAT(ran.out, HasSubstr(kCompleteCommand)) << shell;
  }
  const Ran other = RunTool({"completion", "csh"});
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("\"csh\" is not one of bash, zsh, fish"));
}

}  // namespace completion_test
}  // namespace hulld
