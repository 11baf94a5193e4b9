#include "server/process/descriptors.h"

#include <dirent.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstdlib>
#include <memory>
#include <string_view>

namespace hulld::server {
namespace {

constexpr std::string_view kUnix = "unix:";

// Whether a socket's own end is at the address: the port of TCP, or the path.
bool IsAt(const sockaddr_storage& own, const std::string& address) {
  if (own.ss_family == AF_UNIX) {
    const auto& name = reinterpret_cast<const sockaddr_un&>(own);
    return address.starts_with(kUnix) && address.substr(kUnix.size()) == name.sun_path;
  }
  uint16_t port = 0;
  if (own.ss_family == AF_INET) port = reinterpret_cast<const sockaddr_in&>(own).sin_port;
  if (own.ss_family == AF_INET6) port = reinterpret_cast<const sockaddr_in6&>(own).sin6_port;
  const size_t colon = address.rfind(':');
  return port != 0 && !address.starts_with(kUnix) &&
         std::to_string(ntohs(port)) == address.substr(colon + 1);
}

// Whether the descriptor is the end of a connection that was made to the address.
bool IsConnection(int descriptor, const std::string& address) {
  sockaddr_storage own = {};
  socklen_t size = sizeof own;
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &size) != 0) return false;
  if (!IsAt(own, address)) return false;
  sockaddr_storage peer = {};
  size = sizeof peer;
  // The one that listens has no peer.
  return getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &size) == 0;
}

}  // namespace

OpenDescriptors CountDescriptors(const std::string& address) {
  OpenDescriptors open;
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(
      opendir("/proc/self/fd"), [](DIR* opened) { return opened ? closedir(opened) : 0; });
  if (directory == nullptr) return open;
  while (const dirent* const entry = readdir(directory.get())) {
    const int descriptor = std::atoi(entry->d_name);
    const bool is_number = entry->d_name[0] >= '0' && entry->d_name[0] <= '9';
    if (!is_number || descriptor == dirfd(directory.get())) continue;
    ++open.count;
    if (IsConnection(descriptor, address)) ++open.connections;
  }
  return open;
}

uint64_t MostDescriptors() {
  rlimit limit = {};
  getrlimit(RLIMIT_NOFILE, &limit);
  return limit.rlim_cur;
}

}  // namespace hulld::server
