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

// Appends the available bytes. Returns false at the end of the stream.
bool Receive(int socket, std::string* bytes) {
  char buffer[65536];
  const ssize_t received = recv(socket, buffer, sizeof buffer, 0);
  if (received <= 0) return false;
  bytes->append(buffer, static_cast<size_t>(received));
  return true;
}

// Returns the size of the message at the start of `bytes`: an optional letter, and a length that
// includes itself. nullopt if incomplete.
std::optional<size_t> MessageSize(std::string_view bytes, bool has_letter) {
  const size_t start = has_letter ? 1 : 0;
  if (bytes.size() < start + 4) return std::nullopt;
  uint32_t length = 0;
  for (size_t i = 0; i < 4; ++i)
    length = length << 8 | static_cast<unsigned char>(bytes[start + i]);
  return bytes.size() < start + length ? std::nullopt : std::optional<size_t>(start + length);
}

// Sync: ends a piece.
constexpr char kEndOfPiece = 'S';

// Returns true for messages of the extended protocol, which form pieces.
bool IsOfPiece(std::string_view message) {
  return std::string_view("PBDECHS").find(message.front()) != std::string_view::npos;
}

// Returns true if a client's message parses a statement with this text.
bool IsQuery(std::string_view message, std::string_view text) {
  const std::string parsed = std::string(1, '\0').append(text).append(1, '\0');
  return message.front() == 'P' && message.find(parsed) != std::string_view::npos;
}

}  // namespace

struct CuttingProxy::Connection {
  int client = -1;
  int server = -1;
  bool started = false;
  bool holding = false;
  // Messages of the current piece, and the statements that it contains.
  std::string piece;
  bool begins = false;
  bool commits = false;
  bool listens = false;
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

void CuttingProxy::CutListeners() {
  const std::lock_guard lock(mutex_);
  for (const Connection& connection : connections_) {
    if (connection.client >= 0 && connection.listens) shutdown(connection.client, SHUT_RDWR);
  }
}

void CuttingProxy::WithholdNotices(bool withhold) {
  const std::lock_guard lock(mutex_);
  withholds_notices_ = withhold;
}

void CuttingProxy::SetDelay(std::chrono::milliseconds delay) {
  const std::lock_guard lock(mutex_);
  delay_ = delay;
}

void CuttingProxy::AwaitDelay() {
  std::unique_lock lock(mutex_);
  const std::chrono::milliseconds delay = delay_;
  lock.unlock();
  if (delay.count() > 0) std::this_thread::sleep_for(delay);
}

void CuttingProxy::RefuseToListen() {
  const std::lock_guard lock(mutex_);
  refuses_to_listen_ = true;
}

uint64_t CuttingProxy::answered_bytes() {
  const std::lock_guard lock(mutex_);
  return answered_bytes_;
}

int CuttingProxy::QueryCount(const std::string& text) {
  const std::lock_guard lock(mutex_);
  return query_counts_[text];
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
      AwaitDelay();
      open = Receive(connection.server, &connection.answers) && PassAnswers(connection);
    }
  }
  const std::lock_guard lock(mutex_);
  close(std::exchange(connection.client, -1));
  if (connection.server >= 0) close(connection.server);
}

bool CuttingProxy::IsNext(Cut cut) {
  const std::lock_guard lock(mutex_);
  return next_ == cut;
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

// message: a simple query; its text ends with a zero byte.
void CuttingProxy::NoteQuery(Connection& connection, std::string& message) {
  constexpr size_t kStart = 5;
  const std::string text = message.substr(kStart, message.size() - kStart - 1);
  const std::lock_guard lock(mutex_);
  ++query_counts_[text];
  if (!text.starts_with("LISTEN ")) return;
  connection.listens = true;
  if (refuses_to_listen_) message[kStart] = 'X';
}

// Returns true if the server's answer is withheld from the client.
bool CuttingProxy::NoteAnswer(const Connection& connection, size_t bytes) {
  const std::lock_guard lock(mutex_);
  answered_bytes_ += bytes;
  return withholds_notices_ && connection.listens;
}

// Returns false to cut the connection.
bool CuttingProxy::PassRequests(Connection& connection) {
  std::string& bytes = connection.requests;
  while (const std::optional<size_t> size = MessageSize(bytes, connection.started)) {
    std::string message = bytes.substr(0, *size);
    bytes.erase(0, *size);
    const bool is_request = std::exchange(connection.started, true);
    if (is_request && message.front() == 'Q') NoteQuery(connection, message);
    if (is_request ? !PassRequest(connection, message) : !SendAll(connection.server, message)) {
      return false;
    }
  }
  return true;
}

bool CuttingProxy::PassRequest(Connection& connection, const std::string& message) {
  if (IsQuery(message, "BEGIN") && CutsHere(Cut::kHold)) connection.holding = true;
  if (IsQuery(message, "COMMIT") && CutsHere(Cut::kBeforeCommit)) return false;
  const bool is_kept = connection.holding || !connection.piece.empty() || IsNext(Cut::kHoldCommit);
  if (is_kept && IsOfPiece(message)) return PassPiece(connection, message);
  return SendAll(connection.server, message);
}

// The contents decide if a piece is held, so it is buffered until its end.
bool CuttingProxy::PassPiece(Connection& connection, const std::string& message) {
  connection.piece += message;
  connection.begins = connection.begins || IsQuery(message, "BEGIN");
  connection.commits = connection.commits || IsQuery(message, "COMMIT");
  if (message.front() != kEndOfPiece) return true;
  const std::string piece = std::exchange(connection.piece, {});
  const bool begins = std::exchange(connection.begins, false);
  const bool commits = std::exchange(connection.commits, false);
  const bool is_held = connection.holding || (commits && !begins && CutsHere(Cut::kHoldCommit));
  if (!is_held) return SendAll(connection.server, piece);
  const std::lock_guard lock(mutex_);
  if (held_server_ >= 0) close(held_server_);
  held_ = piece;
  held_server_ = std::exchange(connection.server, -1);
  is_held_.notify_all();
  return false;
}

bool CuttingProxy::PassAnswers(Connection& connection) {
  std::string& bytes = connection.answers;
  while (const std::optional<size_t> size = MessageSize(bytes, true)) {
    const std::string message = bytes.substr(0, *size);
    bytes.erase(0, *size);
    const bool is_commit = message.front() == 'C' && message.find("COMMIT") != std::string::npos;
    if (is_commit && CutsHere(Cut::kAfterCommit)) return false;
    if (NoteAnswer(connection, *size)) continue;
    if (!SendAll(connection.client, message)) return false;
  }
  return true;
}

void CuttingProxy::DeliverOnceHeld(std::chrono::milliseconds longest) {
  {
    std::unique_lock lock(mutex_);
    const bool is_held = is_held_.wait_for(lock, longest, [this] { return held_server_ >= 0; });
    if (!is_held) next_ = Cut::kNone;
    if (!is_held) return;
  }
  Deliver();
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
  // Reads up to the answer to its last message: ReadyForQuery.
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
