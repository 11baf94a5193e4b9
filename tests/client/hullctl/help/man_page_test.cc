#include "client/hullctl/help/man_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "client/hullctl/help/suggestion.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace man_page_test {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Suggestion, IsAPrefixOrSimilar) {
  const std::vector<std::string> words = {"check", "delete", "--verify", "--version"};
  EXPECT_EQ(Suggestion("chek", words), "; did you mean \"check\"?");
  EXPECT_EQ(Suggestion("del", words), "; did you mean \"delete\"?");
  EXPECT_EQ(Suggestion("DELETE", words), "; did you mean \"delete\"?");
  EXPECT_EQ(Suggestion("--verfy", words), "; did you mean \"--verify\"?");
  for (const char* far : {"fly", "", "--", "-", "-v", "d"}) EXPECT_EQ(Suggestion(far, words), "");
}

TEST(ManPage, RepeatsTheHelpInRoff) {
  CommandDescription program;
  program.path = program.name = "tool";
  auto command = std::make_unique<CommandDescription>();
  command->path = "tool fix";
  command->name = "fix";
  command->help = "Mend what's broken";
  command->details = ".starts with a dot\n  an  indented\\line\nflows on";
  command->examples = {{"As root", "tool fix --all"}};
  command->options.emplace_back().names = {"FILE"};
  command->options.back().help = "What to mend";
  command->options.emplace_back().names = {"-o", "--out"};
  command->options.back().help = "Where to";
  command->options.back().value_name = "FILE";
  program.commands.push_back(std::move(command));
  const std::string page = ManPage(program, *program.commands[0], "1.2", {});
  EXPECT_EQ(ManPageName(*program.commands[0]), "tool-fix.1");
  EXPECT_EQ(
      page,
      ".TH TOOL\\-FIX 1 \"\" \"tool 1.2\" \"hulld\"\n"
      ".SH NAME\ntool\\-fix \\- Mend what\\(aqs broken\n"
      ".SH SYNOPSIS\n\\fBtool fix [FILE] [OPTIONS]\\fR\n"
      ".SH DESCRIPTION\nMend what\\(aqs broken.\n"
      ".TP\n\\fBFILE\\fR\nWhat to mend.\n"
      ".TP\n\\fB\\-o\\fR, \\fB\\-\\-out\\fR \\fIFILE\\fR\nWhere to.\n"
      ".PP\n\\&.starts with a dot\n.nf\n  an  indented\\eline\n.fi\nflows on\n"
      ".SH EXAMPLES\n.nf\n# As root\n$ tool fix \\-\\-all\n.fi\n"
      ".SH SEE ALSO\n\\fBtool\\fR(1) describes the options of every command, contexts, and exit "
      "codes.\n");
}

TEST(ManPage, EveryCommandHasAManPage) {
  const std::string folder = ::testing::TempDir() + "/hulld_man_pages";
  std::filesystem::remove_all(folder);
  ASSERT_EQ(RunTool({"__man", folder}).code, 0);
  int pages = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path());
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    EXPECT_THAT(page, HasSubstr(".SH EXAMPLES\n")) << entry.path();
    EXPECT_THAT(page, Not(HasSubstr("__"))) << entry.path();
    ++pages;
  }
  EXPECT_GT(pages, 20);
  std::filesystem::remove_all(folder);
}

}  // namespace man_page_test
}  // namespace hulld
