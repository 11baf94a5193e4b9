#include "client/hullctl/shell/word_splitting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hulld {
namespace word_splitting_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Words(const std::string& line) {
  const auto words = SplitWords(line);
  EXPECT_TRUE(words.ok()) << words.status();
  return words.value_or(std::vector<std::string>());
}

TEST(WordSplitting, CutsAsAShellDoes) {
  EXPECT_THAT(Words("  get\ta/1  "), ElementsAre("get", "a/1"));
  EXPECT_THAT(Words("append a 'my file.xyz' \"b\\\"c d\" e\\ f"),
              ElementsAre("append", "a", "my file.xyz", "b\"c d", "e f"));
  EXPECT_THAT(Words("a''b '' \"\""), ElementsAre("ab", "", ""));
  EXPECT_THAT(Words("list # all of them"), ElementsAre("list"));
  EXPECT_THAT(Words("list a#b"), ElementsAre("list", "a#b"));
  EXPECT_THAT(Words(""), IsEmpty());
  EXPECT_THAT(Words("get 'a|b'"), ElementsAre("get", "a|b"));
}

TEST(WordSplitting, ExplainsWhatItCannotDo) {
  EXPECT_THAT(std::string(SplitWords("get 'a").status().message()), HasSubstr("does not end"));
  EXPECT_THAT(std::string(SplitWords("list | wc").status().message()), HasSubstr("\"|\" is for"));
  EXPECT_FALSE(SplitWords("mesh a > b").ok());
}

TEST(WordSplitting, TheLastWordIsTheOneAtTheCursor) {
  EXPECT_THAT(SplitUnfinished("get a"), ElementsAre("get", "a"));
  EXPECT_THAT(SplitUnfinished("get "), ElementsAre("get", ""));
  EXPECT_THAT(SplitUnfinished(""), ElementsAre(""));
  EXPECT_THAT(SplitUnfinished("append a 'my f"), ElementsAre("append", "a", "my f"));
}

}  // namespace word_splitting_test
}  // namespace hulld
