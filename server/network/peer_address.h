#ifndef HULLD_SERVER_NETWORK_PEER_ADDRESS_H_
#define HULLD_SERVER_NETWORK_PEER_ADDRESS_H_

#include <sys/socket.h>

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hulld::server {

// Address and port of a TCP peer. An IPv4 address equals the IPv6 address that maps it.
struct PeerAddress {
  // In network byte order; IPv4 as ::ffff:a.b.c.d.
  std::array<uint8_t, 16> address{};
  uint16_t port = 0;

  auto operator<=>(const PeerAddress&) const = default;

  // Part of the address that identifies one party: all of an IPv4 address, the first 64 bits of an
  // IPv6 address.
  std::array<uint8_t, 16> Network() const;
  // Name of the network: "ipv4:192.0.2.1", "ipv6:2001:db8::/64".
  std::string NetworkName() const;

  // Returns the address of a socket; nullopt for a unix socket.
  static std::optional<PeerAddress> FromSocket(const sockaddr_storage& name);
  // Parses the result of grpc::ServerContext::peer(): "ipv4:192.0.2.1:80", "ipv6:%5B::1%5D:80".
  static std::optional<PeerAddress> FromGrpc(std::string_view peer);
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_NETWORK_PEER_ADDRESS_H_
