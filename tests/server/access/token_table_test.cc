#include "server/access/token_table.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdio>

#include "tests/server/harness/test_certificates.h"

namespace hulld::server {
namespace token_table_test {

using ::testing::HasSubstr;
using ::testing::Not;

// SHA-256 of "abc" and of "" (FIPS 180-2, appendix B.1, and RFC 6234's test vectors).
constexpr char kAbc[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr char kEmpty[] = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

std::string Line(const std::string& name, const std::string& role, const std::string& prefix,
                 const std::string& hash) {
  return absl::StrCat(name, " ", role, " ", prefix, " sha256:", hash, "\n");
}

TEST(TokenTable, FindsTheCallerByTheHashOfTheToken) {
  const absl::StatusOr<TokenTable> table = TokenTable::Parse(absl::StrCat(
      "# tokens\n\n", Line("a", "read-write", "cell-1/", kAbc), "  \t\r\n",
      "b\tadmin\t*\tsha256:E3B0C44298FC1C149AFBF4C8996FB92427AE41E4649B934CA495991B7852"
      "B855"));
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_EQ(table->size(), 2);
  EXPECT_EQ(table->Find("abc"), (Caller{"a", Permission::kWrite, "cell-1/", 0xba7816bf8f01cfea}));
  EXPECT_EQ(table->Find(""), (Caller{"b", Permission::kAdmin, "", 0xe3b0c44298fc1c14}));
  EXPECT_EQ(table->Find("abd"), std::nullopt);
  EXPECT_EQ(table->Find(std::string("sha256:") + kAbc), std::nullopt);
}

TEST(TokenTable, ErrorsNameTheLineAndQuoteNoHash) {
  const auto expect = [](const std::string& text, const std::string& what) {
    const absl::Status status = TokenTable::Parse(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(what)) << text;
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("ba7816bf"))) << text;
  };
  const std::string good = Line("a", "admin", "*", kAbc);
  expect(good + "b admin *\n", "line 2: expected four fields");
  expect("# x\n" + Line("b", "admin", "* more", kAbc), "line 2: expected four fields");
  expect(Line("-b", "admin", "*", kAbc), "line 1: the name");
  expect(Line(std::string(65, 'b'), "admin", "*", kAbc), "line 1: the name");
  expect(Line("b/c", "admin", "*", kAbc), "line 1: the name");
  expect(Line("b", "root", "*", kAbc), "line 1: the role");
  expect(Line("b", "admin", "cell-1", kAbc), "must end in \"/\"");
  expect(Line("b", "admin", "/", kAbc), "line 1: the prefix is empty");
  expect(Line("b", "admin", "a//", kAbc), "line 1: the prefix \"a/\" has an empty segment");
  expect(Line("b", "admin", "*", std::string(kAbc).substr(1)), "line 1: the hash");
  expect(Line("b", "admin", "*", std::string(64, 'g')), "line 1: the hash");
  expect("b admin * hunter2ba7816bf\n", "never store the token itself");
  expect(good + Line("a", "admin", "*", kEmpty), "line 2: the name \"a\" is already used");
  expect(good + Line("b", "admin", "*", kAbc), "line 2: \"b\" has the token of \"a\"");
}

TEST(TokenTable, AFileAccessibleToOtherUsersIsRefused) {
  const std::string path = ::testing::TempDir() + "/hulld_token_table_test";
  WriteSecret(path, Line("a", "admin", "*", kAbc));
  EXPECT_TRUE(ReadTokensFile(path).ok());
  for (const mode_t mode : {0604, 0602, 0660, 0666}) {
    ASSERT_EQ(chmod(path.c_str(), mode), 0);
    EXPECT_THAT(std::string(ReadTokensFile(path).status().message()),
                HasSubstr("--tokens-file " + path + ": its permissions"));
  }
  WriteSecret(path, "# nobody\n\n");
  EXPECT_THAT(std::string(ReadTokensFile(path).status().message()),
              HasSubstr("--tokens-file " + path + ": it contains no token"));
  EXPECT_TRUE(ReadTokensFile(path, true)->empty());
  std::remove(path.c_str());
  EXPECT_TRUE(ReadTokensFile(path, true)->empty());
  EXPECT_THAT(std::string(ReadTokensFile(path).status().message()), HasSubstr("No such file"));
}

}  // namespace token_table_test
}  // namespace hulld::server
