#include "server/network/connection_acceptor.h"

#include <absl/status/status.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "server/network/guarded_sockets.h"
#include "server/process/descriptors.h"

namespace hulld::server {
namespace {

// Descriptors reserved for the store and everything else: this many, or a quarter of the limit if
// it is low. A store opens a few hundred files.
constexpr uint64_t kReservedDescriptors = 256;
constexpr int kBacklog = 4096;
// Connections accepted from a listener before the next listener's turn.
constexpr int kMaxAtOnce = 64;
// Maximum wait for gRPC to close evicted connections, so that a stuck connection never stops the
// acceptor.
constexpr std::chrono::seconds kMaxWait(1);
// Pause if even the reserve descriptor does not help.
constexpr int kPauseMilliseconds = 50;
// As gRPC sets it along with keepalive: a peer that acknowledges nothing for this long is
// considered gone.
constexpr int kUserTimeoutMs = 20'000;

bool IsOutOfDescriptors(int error) {
  return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

Descriptor OpenReserve() { return Descriptor(open("/dev/null", O_RDONLY | O_CLOEXEC)); }

void SetOption(int socket, int level, int option, int value) {
  setsockopt(socket, level, option, &value, sizeof value);
}

// Returns a listening socket; or an invalid one, and sets `error` to the errno.
Descriptor ListenAt(const sockaddr* name, socklen_t size, bool both_families, int* error) {
  Descriptor socket(::socket(name->sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  *error = errno;
  if (socket.number() < 0) return socket;
  if (name->sa_family != AF_UNIX) SetOption(socket.number(), SOL_SOCKET, SO_REUSEADDR, 1);
  if (name->sa_family == AF_INET6) {
    SetOption(socket.number(), IPPROTO_IPV6, IPV6_V6ONLY, both_families ? 0 : 1);
  }
  if (bind(socket.number(), name, size) == 0 && listen(socket.number(), kBacklog) == 0) {
    return socket;
  }
  *error = errno;
  return Descriptor();
}

int PortOf(const Descriptor& socket) {
  sockaddr_storage name = {};
  socklen_t size = sizeof name;
  getsockname(socket.number(), reinterpret_cast<sockaddr*>(&name), &size);
  const auto peer = PeerAddress::FromSocket(name);
  return peer.has_value() ? peer->port : 0;
}

void SetPort(sockaddr* name, int port) {
  const in_port_t number = htons(static_cast<uint16_t>(port));
  if (name->sa_family == AF_INET) reinterpret_cast<sockaddr_in*>(name)->sin_port = number;
  if (name->sa_family == AF_INET6) reinterpret_cast<sockaddr_in6*>(name)->sin6_port = number;
}

int DescriptorOf(uint64_t id) { return static_cast<int>(id % kMaxGuardedDescriptors); }

bool IsWildcard(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

}  // namespace

absl::StatusOr<std::unique_ptr<ConnectionAcceptor>> ConnectionAcceptor::Listen(
    const ListenAddress& address, ConnectionTable& table, Metrics& metrics) {
  std::unique_ptr<ConnectionAcceptor> acceptor(new ConnectionAcceptor(address, table, metrics));
  const absl::Status bound = address.is_unix() ? acceptor->BindUnix() : acceptor->Bind();
  if (!bound.ok()) return bound;
  return acceptor;
}

ConnectionAcceptor::ConnectionAcceptor(const ListenAddress& address, ConnectionTable& table,
                                       Metrics& metrics)
    : address_(address),
      table_(table),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      reserve_(OpenReserve()),
      accepted_(
          metrics.AddCounter("hulld_connections_accepted_total", "Connections accepted.", {})),
      failures_(metrics.AddCounter("hulld_accept_failures_total",
                                   "Failed attempts to accept a connection.", {})),
      refused_descriptors_(metrics.AddCounter("hulld_connections_refused_total",
                                              "Connections refused, by limit.",
                                              {{"limit", "descriptors"}})),
      refused_total_(metrics.AddCounter("hulld_connections_refused_total", "",
                                        {{"limit", "max-connections"}})),
      refused_network_(metrics.AddCounter("hulld_connections_refused_total", "",
                                          {{"limit", "max-connections-per-address"}})),
      closed_idle_(metrics.AddCounter("hulld_connections_closed_total",
                                      "Connections closed by the server, by reason.",
                                      {{"reason", "idle"}})) {
  const uint64_t max_descriptors = MaxDescriptors();
  const uint64_t reserved = std::min(kReservedDescriptors, max_descriptors / 4);
  first_reserved_ =
      static_cast<int>(std::min<uint64_t>(max_descriptors - reserved, kMaxGuardedDescriptors));
  max_closing_ = std::max<int64_t>(1, static_cast<int64_t>(reserved / 2));
  table_.LowerLimit(static_cast<size_t>(std::max(1, first_reserved_)));
}

absl::Status ConnectionAcceptor::BindUnix() {
  sockaddr_un name = {};
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, address_.path.c_str(), address_.path.size() + 1);
  struct stat left = {};
  // A killed server leaves its socket behind.
  if (lstat(name.sun_path, &left) == 0 && S_ISSOCK(left.st_mode)) unlink(name.sun_path);
  int error = 0;
  Descriptor socket =
      ListenAt(reinterpret_cast<const sockaddr*>(&name), sizeof name, false, &error);
  if (socket.number() < 0) return BindFailure(address_, error, std::strerror(error));
  listeners_.push_back(std::move(socket));
  return absl::OkStatus();
}

absl::Status ConnectionAcceptor::Bind() {
  const bool is_wildcard = IsWildcard(address_.host);
  addrinfo hints = {};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  int error = 0;
  std::string cause;
  // One IPv6 socket serves both families, if the system has IPv6.
  for (const char* const host : {is_wildcard ? "::" : address_.host.c_str(), "0.0.0.0"}) {
    addrinfo* found = nullptr;
    const int resolved = getaddrinfo(host, address_.port.c_str(), &hints, &found);
    if (resolved != 0) cause = gai_strerror(resolved);
    for (addrinfo* info = found; info != nullptr; info = info->ai_next) {
      // All sockets share the port of the first.
      if (!listeners_.empty()) SetPort(info->ai_addr, port_);
      Descriptor socket = ListenAt(info->ai_addr, info->ai_addrlen, is_wildcard, &error);
      if (socket.number() < 0) {
        cause = std::strerror(error);
        continue;
      }
      if (listeners_.empty()) port_ = PortOf(socket);
      listeners_.push_back(std::move(socket));
    }
    if (found != nullptr) freeaddrinfo(found);
    if (!listeners_.empty() || !is_wildcard) break;
  }
  return listeners_.empty() ? BindFailure(address_, error, cause) : absl::OkStatus();
}

ConnectionAcceptor::~ConnectionAcceptor() {
  Stop();
  std::set<uint64_t> open;
  {
    const std::lock_guard lock(mutex_);
    open = connections_;
  }
  for (const uint64_t id : open) {
    Unguard(DescriptorOf(id), id);
    table_.Remove(id);
  }
}

void ConnectionAcceptor::Start(std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> grpc,
                               const FrameLimits* frames) {
  grpc_ = std::move(grpc);
  if (frames != nullptr) frames_ = *frames;
  thread_ = std::thread([this] { Run(); });
}

void ConnectionAcceptor::Stop() {
  if (listeners_.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  room_.notify_all();
  eventfd_write(wake_.number(), 1);
  if (thread_.joinable()) thread_.join();
  listeners_.clear();
  if (address_.is_unix()) unlink(address_.path.c_str());
}

bool ConnectionAcceptor::AwaitRoom() {
  std::unique_lock lock(mutex_);
  room_.wait_for(lock, kMaxWait, [this] { return stopping_ || closing_ < max_closing_; });
  return !stopping_;
}

void ConnectionAcceptor::Run() {
  std::vector<pollfd> sources = {{wake_.number(), POLLIN, 0}};
  for (const Descriptor& listener : listeners_) {
    sources.push_back({listener.number(), POLLIN, 0});
  }
  while (AwaitRoom()) {
    poll(sources.data(), sources.size(), -1);
    bool pause = false;
    for (size_t i = 1; i < sources.size(); ++i) {
      if (sources[i].revents != 0) pause |= !AcceptFrom(sources[i].fd);
    }
    // Only Stop ends the pause early.
    if (pause) poll(sources.data(), 1, kPauseMilliseconds);
  }
}

bool ConnectionAcceptor::AcceptFrom(int listener) {
  for (int i = 0; i < kMaxAtOnce && AwaitRoom(); ++i) {
    sockaddr_storage name = {};
    socklen_t size = sizeof name;
    Descriptor socket(
        accept4(listener, reinterpret_cast<sockaddr*>(&name), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.number() >= 0) {
      accepted_.Increment();
      Admit(std::move(socket), name);
      continue;
    }
    const int error = errno;
    if (error == EAGAIN || error == EWOULDBLOCK) return true;
    failures_.Increment();
    if (IsOutOfDescriptors(error)) return RefuseWithReserve(listener);
    // ECONNABORTED and network errors affect only a single connection.
  }
  return true;
}

bool ConnectionAcceptor::RefuseWithReserve(int listener) {
  if (const uint64_t evicted = table_.Evict(); evicted != 0) {
    Evict(evicted);
    // The new connection is accepted after an evicted one is closed.
    return true;
  }
  reserve_ = Descriptor();
  Descriptor refused(accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  const bool drained = refused.number() >= 0;
  if (drained) refused_descriptors_.Increment();
  refused = Descriptor();
  reserve_ = OpenReserve();
  return drained;
}

void ConnectionAcceptor::Admit(Descriptor socket, const sockaddr_storage& name) {
  if (socket.number() >= first_reserved_) {
    // The new connection holds a reserved descriptor until gRPC closes the evicted one.
    const uint64_t evicted = table_.Evict();
    if (evicted == 0) return refused_descriptors_.Increment();
    Evict(evicted);
  }
  const uint64_t id =
      ++last_number_ * kMaxGuardedDescriptors + static_cast<uint64_t>(socket.number());
  const std::optional<PeerAddress> peer = PeerAddress::FromSocket(name);
  const ConnectionTable::Outcome outcome = table_.Add(id, peer);
  switch (outcome.refusal) {
    case ConnectionTable::Refusal::kTotal:
      return refused_total_.Increment();
    case ConnectionTable::Refusal::kNetwork:
      return refused_network_.Increment();
    case ConnectionTable::Refusal::kNone:
      break;
  }
  Evict(outcome.evicted);
  if (peer.has_value()) {
    SetOption(socket.number(), IPPROTO_TCP, TCP_NODELAY, 1);
    SetOption(socket.number(), IPPROTO_TCP, TCP_USER_TIMEOUT, kUserTimeoutMs);
  }
  {
    const std::lock_guard lock(mutex_);
    connections_.insert(id);
  }
  std::optional<FrameLimits> frames = frames_;
  if (frames.has_value() && peer.has_value()) {
    frames->first_share = shares_.Draw(peer->Network(), FrameGuard::Clock::now());
  }
  GuardSocket(socket.number(), id, frames.has_value() ? &*frames : nullptr,
              [this, id] { OnClosed(id); });
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
  parameters.fd = socket.Release();
  grpc_->HandleNewConnection(&parameters);
}

void ConnectionAcceptor::Evict(uint64_t id) {
  if (id == 0) return;
  {
    const std::lock_guard lock(mutex_);
    ++closing_;
  }
  closed_idle_.Increment();
  // gRPC reads the end of the connection and closes its descriptor.
  ShutDown(DescriptorOf(id), id);
}

void ConnectionAcceptor::OnClosed(uint64_t id) {
  const bool is_evicted = !table_.Remove(id);
  const std::lock_guard lock(mutex_);
  if (is_evicted) --closing_;
  connections_.erase(id);
  room_.notify_all();
}

}  // namespace hulld::server
