#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/postgres/session.h"

namespace hulld::server {
namespace conninfo_test {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Conninfo, KeywordsAndUrisAreAccepted) {
  for (const char* text : {"host=db.example dbname=hulls user=hulld password='two words'\n",
                           "postgresql://hulld:two%20words@db.example/hulls"}) {
    const absl::StatusOr<Conninfo> conninfo = ParseConninfo(text);
    ASSERT_TRUE(conninfo.ok()) << conninfo.status();
    EXPECT_EQ(conninfo->at("host"), "db.example");
    EXPECT_EQ(conninfo->at("dbname"), "hulls");
    EXPECT_EQ(conninfo->at("password"), "two words");
  }
}

TEST(Conninfo, TimeoutsHaveDefaults) {
  const auto defaults = *ParseConninfo("dbname=hulls");
  EXPECT_EQ(defaults.at("connect_timeout"), "5");
  EXPECT_EQ(defaults.at("tcp_user_timeout"), "10000");
  EXPECT_EQ(defaults.at("target_session_attrs"), "read-write");
  const auto given = *ParseConninfo("dbname=hulls connect_timeout=60");
  EXPECT_EQ(given.at("connect_timeout"), "60");
}

// In each string, part of the password would be parsed as the host, the port, or the database, or
// quoted in an error.
TEST(Conninfo, NoErrorQuotesAPassword) {
  for (const char* text :
       {"password=geheim und noch", "password='geheim", "geheim",
        "postgresql://hulld:abc@geheim@db.example/hulls", "postgresql://hulld:geheim/x@db/hulls",
        "postgresql://hulld:12/geheim@db/hulls", "postgresql://hulld:%zzgeheim@db/hulls",
        "geheim=1 host=db", "host=db port=geheim"}) {
    const absl::Status status = ParseConninfo(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("geheim"))) << text;
  }
  EXPECT_EQ(ParseConninfo(" \n").status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace conninfo_test
}  // namespace hulld::server
