// The client against an overloaded real server.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "client/calls/grpc_status.h"
#include "client/client.h"
#include "tests/server/harness/test_server.h"

namespace hulld {
namespace overload_test {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Overload : public server::ServerTest {};

TEST_F(Overload, AClientRetriesAfterTheServersDelay) {
  server::Config config = TestConfig();
  config.limits.max_streams_per_client = 1;
  Restart(config);
  Put("a", server::Cube());
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  server::Appender holder(*hulls_, "a", "holder");
  ASSERT_TRUE(holder.is_open());
  ClientOptions options;
  options.server = server_->address();
  std::vector<milliseconds> waits;
  options.retry.wait = [&](milliseconds wait) {
    waits.push_back(wait);
    EXPECT_TRUE(holder.Finish().ok());
    EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  };
  EXPECT_TRUE(Client(options).OpenAppend("a").ok());
  EXPECT_THAT(waits, ElementsAre(milliseconds(1000)));
}

TEST_F(Overload, APermanentRefusalIsNotRetried) {
  server::Config config = TestConfig();
  config.limits.max_hulls = 1;
  Restart(config);
  Create("a");
  ClientOptions options;
  options.server = server_->address();
  options.retry.wait = [](milliseconds) { ADD_FAILURE(); };
  const absl::Status status = Client(options).CreateHull("b", true).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--max-hulls"));
  EXPECT_EQ(RetryHintOf(status), std::nullopt);
  EXPECT_NE(RequestIdOf(status), "");
}

}  // namespace overload_test
}  // namespace hulld
