// How clients share a server: what one may have at a time, and what is kept for single calls.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <list>
#include <memory>
#include <string>
#include <utility>

#include "server/call/admission.h"
#include "server/call/call_lifetime.h"
#include "server/contract/limit_error.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;

class FairShare : public testing::Test {
 protected:
  // The limit that keeps a call out; empty when it is let in, and then it runs on.
  std::string Refusal(Rpc rpc, const std::string& client) {
    absl::StatusOr<Admission::Ticket> ticket = admission_->Admit({.rpc = rpc, .client = client});
    if (!ticket.ok()) {
      last_message_ = std::string(ticket.status().message());
      return ExceededLimit(ticket.status()).value_or("none");
    }
    tickets_.push_back(*std::move(ticket));
    return "";
  }

  void Begin(const Limits& limits) { admission_ = std::make_unique<Admission>(limits, metrics_); }

  Metrics metrics_;
  std::unique_ptr<Admission> admission_;
  std::list<Admission::Ticket> tickets_;
  std::string last_message_;
};

TEST_F(FairShare, NoClientFillsTheServer) {
  Limits limits;
  limits.max_calls_per_client = 3;
  Begin(limits);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(Refusal(Rpc::kGetHull, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kGetHull, "token:a"), "max-calls-per-client");
  EXPECT_EQ(Refusal(Rpc::kGetHull, "token:b"), "");
  // What tells the operator how the server is.
  EXPECT_EQ(Refusal(Rpc::kGetStatus, "token:a"), "");
  tickets_.pop_front();
  tickets_.pop_front();
  EXPECT_EQ(Refusal(Rpc::kGetHull, "token:a"), "");
}

TEST_F(FairShare, AClientHasSoManyBatches) {
  Limits limits;
  limits.max_batches_per_client = 1;
  Begin(limits);
  EXPECT_EQ(Refusal(Rpc::kFindCollisions, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kBatchCheckCollisions, "token:a"), "max-batches-per-client");
  EXPECT_EQ(Refusal(Rpc::kBatchCheckCollisions, "token:b"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:a"), "");
}

TEST_F(FairShare, APartIsKeptForSingleCalls) {
  Limits limits;
  limits.max_calls = 12;
  limits.max_calls_per_client = 8;
  Begin(limits);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(Refusal(Rpc::kWatchHulls, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kWatchHulls, "token:a"), "max-calls-per-client");
  EXPECT_THAT(last_message_, HasSubstr("the last 2 are kept for single calls"));
  for (int i = 0; i < 2; ++i) EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:a"), "max-calls-per-client");
  // The same holds for the whole server.
  EXPECT_EQ(Refusal(Rpc::kFindCollisions, "token:b"), "");
  EXPECT_EQ(Refusal(Rpc::kFindCollisions, "token:b"), "max-calls");
  EXPECT_THAT(last_message_, HasSubstr("the last 3 are kept for single calls"));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:b"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:b"), "max-calls");
}

TEST_F(FairShare, ACallWaitsForItsOwnPoolAlone) {
  Limits limits;
  limits.max_waiting_calls = 5;
  Begin(limits);
  size_t writers = 5;
  size_t others = 4;
  admission_->SetBacklog([&](Rpc rpc) { return UsesWriters(rpc) ? writers : others; });
  EXPECT_EQ(Refusal(Rpc::kAppendPoints, "a"), "max-waiting-calls");
  EXPECT_EQ(Refusal(Rpc::kReplaceHull, "a"), "max-waiting-calls");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "a"), "");
  std::swap(writers, others);
  EXPECT_EQ(Refusal(Rpc::kAppendPoints, "a"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "a"), "max-waiting-calls");
}

TEST(CallLifetime, DeadlinesDoNotFollowTheTimeOfDay) {
  using Clock = CallLifetime::Clock;
  using WallClock = CallLifetime::WallClock;
  using std::chrono::hours;
  using std::chrono::seconds;
  const Clock::time_point now = Clock::now();
  // The time of day does not matter, even when it is set a year on or back.
  for (const WallClock::time_point wall :
       {WallClock::now(), WallClock::now() + hours(8760), WallClock::now() - hours(8760)}) {
    EXPECT_EQ(CallLifetime(wall + seconds(5), wall, now).deadline(), now + seconds(5));
    EXPECT_FALSE(CallLifetime(wall + seconds(500), wall, now).ShouldStop());
    EXPECT_TRUE(CallLifetime(wall - seconds(1), wall, now).ShouldStop());
    EXPECT_TRUE(absl::IsDeadlineExceeded(CallLifetime(wall, wall, now).StopStatus()));
    // As good as none.
    EXPECT_EQ(CallLifetime(wall + hours(1'000'000), wall, now).deadline(),
              Clock::time_point::max());
  }
  EXPECT_EQ(CallLifetime(WallClock::time_point::max()).deadline(), Clock::time_point::max());
}

}  // namespace
}  // namespace hulld::server
