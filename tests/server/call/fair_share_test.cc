// Sharing of a server among clients: the quota of each, and the capacity reserved for single calls.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/call/admission.h"
#include "server/call/call_lifetime.h"
#include "server/contract/errors.h"
#include "server/network/connection_table.h"
#include "server/network/peer_address.h"

namespace hulld::server {
namespace fair_share_test {

using ::testing::HasSubstr;

class FairShare : public testing::Test {
 protected:
  // Returns the limit that refuses a call; empty if admitted, and then it keeps running.
  std::string Refusal(Rpc rpc, const std::string& client,
                      const std::optional<PeerAddress>& peer = std::nullopt) {
    absl::StatusOr<Admission::Ticket> ticket =
        admission_->Admit({.rpc = rpc, .client = client, .peer = peer});
    if (!ticket.ok()) {
      last_message_ = std::string(ticket.status().message());
      return ExceededLimit(ticket.status()).value_or("none");
    }
    tickets_.push_back(*std::move(ticket));
    return "";
  }

  void Begin(const Limits& limits) {
    admission_ = std::make_unique<Admission>(limits, metrics_, connections_);
  }

  Metrics metrics_;
  ConnectionTable connections_{100, 100};
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
  // Calls that show the operator the server's state.
  EXPECT_EQ(Refusal(Rpc::kGetStatus, "token:a"), "");
  tickets_.pop_front();
  tickets_.pop_front();
  EXPECT_EQ(Refusal(Rpc::kGetHull, "token:a"), "");
}

TEST_F(FairShare, BatchesPerClientAreLimited) {
  Limits limits;
  limits.max_batches_per_client = 1;
  Begin(limits);
  EXPECT_EQ(Refusal(Rpc::kFindCollisions, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kBatchCheckCollisions, "token:a"), "max-batches-per-client");
  EXPECT_EQ(Refusal(Rpc::kBatchCheckCollisions, "token:b"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:a"), "");
}

TEST_F(FairShare, CapacityIsReservedForSingleCalls) {
  Limits limits;
  limits.max_calls = 12;
  limits.max_calls_per_client = 8;
  Begin(limits);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(Refusal(Rpc::kWatchHulls, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kWatchHulls, "token:a"), "max-calls-per-client");
  EXPECT_THAT(last_message_, HasSubstr("2 slots are reserved for single calls"));
  for (int i = 0; i < 2; ++i) EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:a"), "max-calls-per-client");
  // The limit of the whole server works in the same way.
  EXPECT_EQ(Refusal(Rpc::kFindCollisions, "token:b"), "");
  EXPECT_EQ(Refusal(Rpc::kFindCollisions, "token:b"), "max-calls");
  EXPECT_THAT(last_message_, HasSubstr("3 slots are reserved for single calls"));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:b"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "token:b"), "max-calls");
}

TEST_F(FairShare, ACallWaitsOnlyForItsOwnPool) {
  Limits limits;
  limits.max_waiting_calls = 5;
  Begin(limits);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Refusal(Rpc::kGetStatus, "b"), "");
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

// Thousands of new or woken watches wait.
TEST_F(FairShare, WaitingStreamsRefuseNoSingleCall) {
  Limits limits;
  limits.max_waiting_calls = 5;
  Begin(limits);
  size_t waiting = 5000;
  admission_->SetBacklog([&](Rpc) { return waiting; });
  EXPECT_EQ(Refusal(Rpc::kWatchHulls, "a"), "max-waiting-calls");
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Refusal(Rpc::kCheckCollision, "b"), "");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "b"), "max-waiting-calls");
  // None of the running single calls waits.
  waiting = 0;
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "b"), "");
}

TEST_F(FairShare, CallsWithoutATokenHaveTheirOwnShare) {
  Limits limits;
  limits.max_calls = 12;
  limits.max_anonymous_calls = 16;
  Begin(limits);
  for (int client = 0; client < 8; ++client) {
    const std::string address = "ipv4:192.0.2." + std::to_string(client);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(Refusal(Rpc::kServerReflectionInfo, address), "");
    EXPECT_EQ(Refusal(Rpc::kServerReflectionInfo, address), "max-anonymous-calls");
  }
  EXPECT_EQ(Refusal(Rpc::kServerReflectionInfo, "ipv4:192.0.2.9"), "max-anonymous-calls");
  for (int i = 0; i < 9; ++i) EXPECT_EQ(Refusal(Rpc::kAppendPoints, "token:a"), "");
  EXPECT_EQ(Refusal(Rpc::kAppendPoints, "token:a"), "max-calls");
  tickets_.pop_front();
  EXPECT_EQ(Refusal(Rpc::kServerReflectionInfo, "ipv4:192.0.2.0"), "");
}

// Clients open one watch for each connection, and fail without it.
TEST_F(FairShare, AConnectionHasAHealthWatchOutsideAllShares) {
  Limits limits;
  limits.max_anonymous_calls = 8;
  limits.max_calls = 1;
  Begin(limits);
  const std::string client = "ipv4:192.0.2.1";
  const auto peer = [](uint16_t port) {
    return PeerAddress::FromGrpc("ipv4:192.0.2.1:" + std::to_string(port));
  };
  for (uint16_t port = 1; port <= 20; ++port) {
    connections_.Add(port, peer(port));
    EXPECT_EQ(Refusal(Rpc::kHealthWatch, client, peer(port)), "");
  }
  EXPECT_EQ(Refusal(Rpc::kHealthWatch, client, peer(1)), "");
  EXPECT_EQ(Refusal(Rpc::kHealthWatch, client, peer(1)), "max-anonymous-calls");
  EXPECT_EQ(Refusal(Rpc::kHealthWatch, client, peer(2)), "max-anonymous-calls");
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, client, peer(1)), "");
  // After its watch ends, a connection may open another one.
  tickets_.pop_front();
  EXPECT_EQ(Refusal(Rpc::kHealthWatch, client, peer(1)), "");
  // A proxy on this machine has the watches of all its clients.
  for (int i = 0; i < 20; ++i) EXPECT_EQ(Refusal(Rpc::kHealthWatch, "unix:"), "");
}

TEST_F(FairShare, CallsWithoutATokenKeepNoConnectionFromEviction) {
  Begin(Limits());
  const auto peer = PeerAddress::FromGrpc("ipv4:192.0.2.1:1");
  connections_.Add(1, peer);
  EXPECT_EQ(Refusal(Rpc::kHealthWatch, "ipv4:192.0.2.1", peer), "");
  EXPECT_EQ(Refusal(Rpc::kServerReflectionInfo, "ipv4:192.0.2.1", peer), "");
  EXPECT_EQ(connections_.Evict(), 1);
}

TEST_F(FairShare, CallsOfABusyClientAreMarked) {
  Begin(Limits());
  for (uint64_t i = 0; i < Admission::kBusyCalls; ++i) {
    EXPECT_EQ(Refusal(Rpc::kCheckCollision, "a"), "");
    EXPECT_FALSE(tickets_.back().is_client_busy());
  }
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "a"), "");
  EXPECT_TRUE(tickets_.back().is_client_busy());
  EXPECT_EQ(Refusal(Rpc::kCheckCollision, "b"), "");
  EXPECT_FALSE(tickets_.back().is_client_busy());
}

TEST(CallLifetime, DeadlinesDoNotFollowTheTimeOfDay) {
  using Clock = CallLifetime::Clock;
  using WallClock = CallLifetime::WallClock;
  using std::chrono::hours;
  using std::chrono::seconds;
  const Clock::time_point now = Clock::now();
  // Wall-clock changes have no effect, even by a year in either direction.
  for (const WallClock::time_point wall :
       {WallClock::now(), WallClock::now() + hours(8760), WallClock::now() - hours(8760)}) {
    EXPECT_EQ(CallLifetime(wall + seconds(5), wall, now).deadline(), now + seconds(5));
    EXPECT_FALSE(CallLifetime(wall + seconds(500), wall, now).ShouldStop());
    EXPECT_TRUE(CallLifetime(wall - seconds(1), wall, now).ShouldStop());
    EXPECT_TRUE(absl::IsDeadlineExceeded(CallLifetime(wall, wall, now).StopStatus()));
    // Effectively no deadline.
    EXPECT_EQ(CallLifetime(wall + hours(1'000'000), wall, now).deadline(),
              Clock::time_point::max());
  }
  EXPECT_EQ(CallLifetime(WallClock::time_point::max()).deadline(), Clock::time_point::max());
}

}  // namespace fair_share_test
}  // namespace hulld::server
