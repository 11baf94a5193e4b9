#include "client/server_address.h"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <arpa/inet.h>
#include <sys/un.h>

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <vector>

namespace hulld {
namespace {

enum class HostKind { kName, kIpv4, kIpv6 };

HostKind KindOf(const std::string& host) {
  in6_addr bytes;
  if (inet_pton(AF_INET, host.c_str(), &bytes) == 1) return HostKind::kIpv4;
  const bool in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (in_brackets && inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), &bytes) == 1) {
    return HostKind::kIpv6;
  }
  return HostKind::kName;
}

std::string HostOf(const std::string& server) { return server.substr(0, server.rfind(':')); }

// Returns true for the characters of names and of addresses, which may end in a zone, as in
// "%eth0".
bool IsHostCharacter(char c) {
  return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
         std::string_view(".-_[]:%").find(c) != std::string_view::npos;
}

// gRPC reports these defects as INTERNAL, without a reason.
absl::Status ValidateSocket(const std::string& server) {
  const std::string path = server.substr(server.starts_with("unix:///") ? 7 : 5);
  if (path.empty() || path.starts_with("//")) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", server, "\" is not unix:PATH or unix:///PATH"));
  }
  if (path.size() < sizeof(sockaddr_un::sun_path)) return absl::OkStatus();
  return absl::InvalidArgumentError("the path of a unix socket must have at most 107 characters");
}

bool IsTargetName(const std::string& server) {
  return server.starts_with("unix:") || server.find(":///") != std::string::npos;
}

bool IsHostAndPort(const std::string& server) {
  const size_t colon = server.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  if (!std::all_of(server.begin(), server.end(), IsHostCharacter)) return false;
  const std::string port = server.substr(colon + 1);
  const bool is_number =
      std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  uint32_t number = 0;
  if (!is_number || !absl::SimpleAtoi(port, &number) || number == 0 || number > 65535) return false;
  return server.find(':') == colon || server[0] == '[';
}

std::vector<std::string> Listed(const std::string& server) { return absl::StrSplit(server, ','); }

absl::Status ValidateList(const std::string& server) {
  const std::vector<std::string> servers = Listed(server);
  for (const std::string& one : servers) {
    if (!IsHostAndPort(one)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "\"", one, "\" is not ADDRESS:PORT; write a list as 10.0.0.1:50551,10.0.0.2:50551"));
    }
    const HostKind kind = KindOf(HostOf(one));
    if (kind == HostKind::kName) {
      return absl::InvalidArgumentError(
          absl::StrCat("\"", HostOf(one),
                       "\" is a name, but a list must contain IP addresses; alternatively, give "
                       "several servers one DNS name, as in dns:///hulls.example:50551"));
    }
    if (kind != KindOf(HostOf(servers.front()))) {
      return absl::InvalidArgumentError(
          absl::StrCat("\"", server, "\" lists IPv4 and IPv6 addresses; use one kind"));
    }
  }
  return absl::OkStatus();
}

bool IsLoopbackHost(const std::string& host) {
  if (host == "localhost" || host == "[::1]") return true;
  // Must be an address, not a name with the same prefix.
  return host.starts_with("127.") && KindOf(host) == HostKind::kIpv4;
}

bool IsList(const std::string& server) {
  return !IsTargetName(server) && server.find(',') != std::string::npos;
}

}  // namespace

absl::Status ValidateServer(const std::string& server) {
  if (server.starts_with("unix:")) return ValidateSocket(server);
  if (IsTargetName(server) || IsHostAndPort(server)) return absl::OkStatus();
  if (IsList(server)) return ValidateList(server);
  return absl::InvalidArgumentError(
      absl::StrCat("\"", server, "\" is not HOST:PORT, such as 127.0.0.1:50551"));
}

bool NamesSeveral(const std::string& server) {
  return IsList(server) || server.starts_with("dns:///");
}

std::string TargetName(const std::string& server) {
  if (!IsList(server)) return server;
  return absl::StrCat(KindOf(HostOf(Listed(server).front())) == HostKind::kIpv6 ? "ipv6:" : "ipv4:",
                      server);
}

bool IsLoopback(const std::string& server) {
  if (server.starts_with("unix:")) return true;
  const std::vector<std::string> servers = Listed(server);
  return std::all_of(servers.begin(), servers.end(),
                     [](const std::string& one) { return IsLoopbackHost(HostOf(one)); });
}

}  // namespace hulld
