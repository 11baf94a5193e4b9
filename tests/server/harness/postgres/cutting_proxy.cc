#include "tests/server/harness/postgres/cutting_proxy.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

namespace hulld::server {
namespace {

constexpr char kSocketName[] = "/.s.PGSQL.5432";

sockaddr_un AddressOf(const std::string& directory) {
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, (directory + kSocketName).c_str(), sizeof address.sun_path - 1);
  return address;
}

bool SendAll(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<size_t>(sent));
  }
  return true;
}

// Appends what is there; false at the end.
bool Receive(int socket, std::string* bytes) {
  char buffer[65536];
  const ssize_t received = recv(socket, buffer, sizeof buffer, 0);
  if (received <= 0) return false;
  bytes->append(buffer, static_cast<size_t>(received));
  return true;
}

// The size of the message that `bytes` starts with: a letter, if it has one, and a length that
// counts itself. None while that is not complete.
std::optional<size_t> MessageSize(std::string_view bytes, bool has_letter) {
  const size_t start = has_letter ? 1 : 0;
  if (bytes.size() < start + 4) return std::nullopt;
  uint32_t length = 0;
  for (size_t i = 0; i < 4; ++i)
    length = length << 8 | static_cast<unsigned char>(bytes[start + i]);
  return bytes.size() < start + length ? std::nullopt : std::optional<size_t>(start + length);
}

// Whether a client's message asks for this statement by its text.
bool Asks(std::string_view message, std::string_view text) {
  const std::string parsed = std::string(1, '\0').append(text).append(1, '\0');
  return message.front() == 'P' && message.find(parsed) != std::string_view::npos;
}

}  // namespace

struct CuttingProxy::Connection {
  int client = -1;
  int server = -1;
  bool started = false;
  bool holding = false;
  std::string requests;
  std::string answers;
  std::thread thread;
};

CuttingProxy::CuttingProxy(const std::string& socket_directory) : server_(socket_directory) {
  std::string name = "/tmp/hulld-proxy-XXXXXX";
  directory_ = mkdtemp(name.data());
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_un address = AddressOf(directory_);
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listener_, 64) != 0) {
    std::abort();
  }
  acceptor_ = std::thread([this] { Accept(); });
}

CuttingProxy::~CuttingProxy() {
  SetDown(true);
  shutdown(listener_, SHUT_RDWR);
  acceptor_.join();
  close(listener_);
  for (Connection& connection : connections_) connection.thread.join();
  if (held_server_ >= 0) close(held_server_);
  std::filesystem::remove_all(directory_);
}

void CuttingProxy::CutNext(Cut cut) {
  const std::lock_guard lock(mutex_);
  next_ = cut;
}

void CuttingProxy::SetDown(bool down) {
  const std::lock_guard lock(mutex_);
  down_ = down;
  down_with_cut_ = false;
  if (!down) return;
  for (const Connection& connection : connections_) {
    if (connection.client >= 0) shutdown(connection.client, SHUT_RDWR);
  }
}

void CuttingProxy::GoDownWithCut() {
  const std::lock_guard lock(mutex_);
  down_with_cut_ = true;
}

int CuttingProxy::cuts() {
  const std::lock_guard lock(mutex_);
  return cuts_;
}

void CuttingProxy::Accept() {
  while (true) {
    const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) return;
    const std::lock_guard lock(mutex_);
    const int server = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_un address = AddressOf(server_);
    if (down_ ||
        connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      close(client);
      close(server);
      continue;
    }
    Connection& connection = connections_.emplace_back();
    connection.client = client;
    connection.server = server;
    connection.thread = std::thread([this, &connection] { Serve(connection); });
  }
}

void CuttingProxy::Serve(Connection& connection) {
  bool open = true;
  while (open) {
    pollfd sockets[] = {{connection.client, POLLIN, 0}, {connection.server, POLLIN, 0}};
    if (poll(sockets, 2, -1) < 0) break;
    if (sockets[0].revents != 0) {
      open = Receive(connection.client, &connection.requests) && PassRequests(connection);
    }
    if (open && sockets[1].revents != 0) {
      open = Receive(connection.server, &connection.answers) && PassAnswers(connection);
    }
  }
  const std::lock_guard lock(mutex_);
  close(std::exchange(connection.client, -1));
  if (connection.server != held_server_) close(connection.server);
}

bool CuttingProxy::CutsHere(Cut cut) {
  const std::lock_guard lock(mutex_);
  if (next_ != cut) return false;
  next_ = Cut::kNone;
  ++cuts_;
  down_ = down_ || std::exchange(down_with_cut_, false);
  if (down_) {
    for (const Connection& connection : connections_) {
      if (connection.client >= 0) shutdown(connection.client, SHUT_RDWR);
    }
  }
  return true;
}

// False: the connection is to be cut.
bool CuttingProxy::PassRequests(Connection& connection) {
  std::string& bytes = connection.requests;
  while (const std::optional<size_t> size = MessageSize(bytes, connection.started)) {
    const std::string message = bytes.substr(0, *size);
    bytes.erase(0, *size);
    const bool is_request = std::exchange(connection.started, true);
    if (is_request && Asks(message, "BEGIN") && CutsHere(Cut::kHold)) connection.holding = true;
    if (is_request && Asks(message, "COMMIT") && CutsHere(Cut::kBeforeCommit)) return false;
    if (!connection.holding) {
      if (!SendAll(connection.server, message)) return false;
      continue;
    }
    const std::lock_guard lock(mutex_);
    held_ += message;
    // The end of what is sent in one piece.
    if (message.front() == 'S') {
      held_server_ = connection.server;
      return false;
    }
  }
  return true;
}

bool CuttingProxy::PassAnswers(Connection& connection) {
  std::string& bytes = connection.answers;
  while (const std::optional<size_t> size = MessageSize(bytes, true)) {
    const std::string message = bytes.substr(0, *size);
    bytes.erase(0, *size);
    const bool is_commit = message.front() == 'C' && message.find("COMMIT") != std::string::npos;
    if (is_commit && CutsHere(Cut::kAfterCommit)) return false;
    if (!SendAll(connection.client, message)) return false;
  }
  return true;
}

void CuttingProxy::Deliver() {
  int server = -1;
  std::string held;
  {
    const std::lock_guard lock(mutex_);
    server = std::exchange(held_server_, -1);
    held = std::exchange(held_, {});
  }
  if (server < 0) std::abort();
  SendAll(server, held);
  // The answer to the message that ended it: ready for the next.
  std::string answers;
  while (Receive(server, &answers)) {
    bool is_ready = false;
    while (const std::optional<size_t> size = MessageSize(answers, true)) {
      is_ready = is_ready || answers.front() == 'Z';
      answers.erase(0, *size);
    }
    if (is_ready) break;
  }
  close(server);
}

}  // namespace hulld::server
