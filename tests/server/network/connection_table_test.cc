#include "server/network/connection_table.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include <optional>
#include <string>

#include "server/network/peer_address.h"

namespace hulld::server {
namespace connection_table_test {

using Refusal = ConnectionTable::Refusal;

PeerAddress Peer(const std::string& text) {
  const auto peer = PeerAddress::FromGrpc(text);
  EXPECT_TRUE(peer.has_value()) << text;
  return peer.value_or(PeerAddress());
}

TEST(PeerAddress, GrpcAndSocketsNameTheSamePeer) {
  sockaddr_storage name = {};
  auto& v6 = reinterpret_cast<sockaddr_in6&>(name);
  v6.sin6_family = AF_INET6;
  v6.sin6_port = htons(7);
  inet_pton(AF_INET6, "2001:db8:1:2:3::4", &v6.sin6_addr);
  EXPECT_EQ(PeerAddress::FromSocket(name), Peer("ipv6:%5B2001:db8:1:2:3::4%5D:7"));
  EXPECT_EQ(PeerAddress::FromSocket(name), Peer("ipv6:[2001:db8:1:2:3::4%25eth0]:7"));
  EXPECT_EQ(Peer("ipv6:[2001:db8:1:2:3::4]:7").NetworkName(), "ipv6:2001:db8:1:2::/64");
  inet_pton(AF_INET6, "::ffff:192.0.2.1", &v6.sin6_addr);
  EXPECT_EQ(PeerAddress::FromSocket(name), Peer("ipv4:192.0.2.1:7"));
  EXPECT_EQ(Peer("ipv4:192.0.2.1:7").NetworkName(), "ipv4:192.0.2.1");
  EXPECT_EQ(PeerAddress::FromGrpc("unix:"), std::nullopt);
  EXPECT_EQ(PeerAddress::FromGrpc("ipv4:x:7"), std::nullopt);
  EXPECT_EQ(PeerAddress::FromGrpc(""), std::nullopt);
}

TEST(ConnectionTable, TheLongestIdleConnectionIsEvicted) {
  ConnectionTable table(3, 3);
  EXPECT_EQ(table.Add(1, Peer("ipv4:192.0.2.1:1")).evicted, 0);
  EXPECT_EQ(table.Add(2, Peer("ipv4:192.0.2.2:1")).evicted, 0);
  EXPECT_EQ(table.Add(3, Peer("ipv4:192.0.2.3:1")).evicted, 0);
  // The end of a call makes its connection the last to evict.
  EXPECT_EQ(table.BeginCall(Peer("ipv4:192.0.2.1:1")), 1);
  table.EndCall(1);
  EXPECT_EQ(table.Add(4, Peer("ipv4:192.0.2.4:1")).evicted, 2);
  EXPECT_EQ(table.Add(5, Peer("ipv4:192.0.2.5:1")).evicted, 3);
  EXPECT_EQ(table.Add(6, Peer("ipv4:192.0.2.6:1")).evicted, 1);
  EXPECT_EQ(table.size(), 3);
}

TEST(ConnectionTable, ConnectionsWithCallsAreKept) {
  ConnectionTable table(1, 1);
  table.Add(1, Peer("ipv4:192.0.2.1:1"));
  EXPECT_EQ(table.BeginCall(Peer("ipv4:192.0.2.1:1")), 1);
  EXPECT_EQ(table.Add(2, Peer("ipv4:192.0.2.2:1")).refusal, Refusal::kTotal);
  EXPECT_EQ(table.Evict(), 0);
  table.Remove(1);
  EXPECT_EQ(table.Add(3, Peer("ipv4:192.0.2.1:1")).refusal, Refusal::kNone);
  // A call of the previous connection, at the same address and port.
  table.EndCall(1);
  EXPECT_EQ(table.Evict(), 3);
}

TEST(ConnectionTable, ConnectionsPerNetworkAreLimited) {
  ConnectionTable table(10, 2);
  const auto add = [&table](uint64_t id, const std::string& peer) {
    return table.Add(id, Peer(peer));
  };
  EXPECT_EQ(add(1, "ipv4:192.0.2.9:1").evicted, 0);
  EXPECT_EQ(add(2, "ipv6:[2001:db8::1]:1").evicted, 0);
  EXPECT_EQ(add(3, "ipv6:[2001:db8::2]:1").evicted, 0);
  // Evicts one of its own, although another has been idle for longer.
  EXPECT_EQ(add(4, "ipv6:[2001:db8::3]:1").evicted, 2);
  EXPECT_EQ(add(5, "ipv6:[2001:db8:0:1::3]:1").evicted, 0);
  table.BeginCall(Peer("ipv6:[2001:db8::2]:1"));
  table.BeginCall(Peer("ipv6:[2001:db8::3]:1"));
  EXPECT_EQ(add(6, "ipv6:[2001:db8::4]:1").refusal, Refusal::kNetwork);
  // An IPv4 address and its IPv6-mapped address are the same peer.
  EXPECT_EQ(add(7, "ipv6:[::ffff:192.0.2.9]:2").evicted, 0);
  EXPECT_EQ(add(8, "ipv4:192.0.2.9:3").evicted, 1);
}

TEST(ConnectionTable, UnixSocketsCountOnlyTowardTheTotal) {
  ConnectionTable table(3, 1);
  for (const uint64_t id : {1, 2, 3}) {
    EXPECT_EQ(table.Add(id, std::nullopt).refusal, Refusal::kNone);
  }
  EXPECT_EQ(table.BeginCall(std::nullopt), 0);
  EXPECT_EQ(table.Add(4, std::nullopt).refusal, Refusal::kTotal);
  table.Remove(2);
  EXPECT_EQ(table.Add(5, std::nullopt).refusal, Refusal::kNone);
}

}  // namespace connection_table_test
}  // namespace hulld::server
