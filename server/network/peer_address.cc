#include "server/network/peer_address.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>

namespace hulld::server {
namespace {

constexpr size_t kMappedBytes = 12;
constexpr std::array<uint8_t, kMappedBytes> kMapped = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
constexpr size_t kNetworkBytes = 8;

bool IsMapped(const std::array<uint8_t, 16>& address) {
  return std::equal(kMapped.begin(), kMapped.end(), address.begin());
}

}  // namespace

std::array<uint8_t, 16> PeerAddress::Network() const {
  std::array<uint8_t, 16> network = address;
  if (!IsMapped(address)) std::fill(network.begin() + kNetworkBytes, network.end(), 0);
  return network;
}

std::string PeerAddress::NetworkName() const {
  const std::array<uint8_t, 16> network = Network();
  char text[INET6_ADDRSTRLEN] = {};
  if (IsMapped(network)) {
    inet_ntop(AF_INET, network.data() + kMappedBytes, text, sizeof text);
    return absl::StrCat("ipv4:", text);
  }
  inet_ntop(AF_INET6, network.data(), text, sizeof text);
  return absl::StrCat("ipv6:", text, "/64");
}

std::optional<PeerAddress> PeerAddress::FromSocket(const sockaddr_storage& name) {
  if (name.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(name);
    PeerAddress peer{.address = {}, .port = ntohs(v4.sin_port)};
    std::copy(kMapped.begin(), kMapped.end(), peer.address.begin());
    std::memcpy(peer.address.data() + kMappedBytes, &v4.sin_addr, sizeof v4.sin_addr);
    return peer;
  }
  if (name.ss_family != AF_INET6) return std::nullopt;
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(name);
  PeerAddress peer{.address = {}, .port = ntohs(v6.sin6_port)};
  std::copy(std::begin(v6.sin6_addr.s6_addr), std::end(v6.sin6_addr.s6_addr), peer.address.begin());
  return peer;
}

std::optional<PeerAddress> PeerAddress::FromGrpc(std::string_view peer) {
  const size_t colon = peer.rfind(':');
  const bool is_v4 = peer.starts_with("ipv4:");
  if ((!is_v4 && !peer.starts_with("ipv6:")) || colon < 5) return std::nullopt;
  uint32_t port = 0;
  const std::string number(peer.substr(colon + 1));
  if (!absl::SimpleAtoi(number, &port) || port > UINT16_MAX) return std::nullopt;
  std::string host(peer.substr(5, colon - 5));
  if (is_v4) host.insert(0, "::ffff:");
  // Brackets are percent-encoded.
  for (const char* const bracket : {"%5B", "%5D", "[", "]"}) {
    if (const size_t at = host.find(bracket); at != std::string::npos) {
      host.erase(at, std::strlen(bracket));
    }
  }
  // Removes the zone of a link-local address.
  host.resize(std::min(host.size(), host.find('%')));
  PeerAddress found{.address = {}, .port = static_cast<uint16_t>(port)};
  if (inet_pton(AF_INET6, host.c_str(), found.address.data()) != 1) return std::nullopt;
  return found;
}

}  // namespace hulld::server
