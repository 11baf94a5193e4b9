// Small programs that attack hulld. Each ends with a server that still answers and, for attacks on
// one connection, with the end of that connection. The same attacks run against haproxy as
// configured by docker/haproxy/front.cfg.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/network/frame_bytes.h"
#include "tests/source_tree.h"

namespace hulld::server {
namespace attacks_test {

constexpr char kCheckHealth[] = "/grpc.health.v1.Health/Check";
constexpr char kHaproxy[] = "/usr/sbin/haproxy";

// One connection to "127.0.0.1:PORT".
class Attacker {
 public:
  explicit Attacker(const std::string& address) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in name = {};
    name.sin_family = AF_INET;
    name.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
  }
  Attacker(Attacker&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), connected_(other.connected_) {}
  ~Attacker() {
    if (socket_ >= 0) close(socket_);
  }

  bool connected() const { return connected_; }

  // Returns false after the server has closed the connection. Replies are dropped, so that none
  // fills the connection.
  bool Send(const std::string& bytes) {
    std::array<char, 65536> replies;
    ssize_t received;
    while ((received = recv(socket_, replies.data(), replies.size(), MSG_DONTWAIT)) > 0) {
    }
    if (received == 0) return false;
    return send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }

  // Waits for the end of the connection; bounded by the time limit of the test.
  void AwaitEnd() {
    std::array<char, 65536> replies;
    while (recv(socket_, replies.data(), replies.size(), 0) > 0) {
    }
  }

 private:
  int socket_;
  bool connected_ = false;
};

std::string Open(uint32_t stream) {
  return FrameBytes(Frame::kHeaders, kEndHeadersFlag, stream, HeaderBlock(kCheckHealth));
}

// The bytes that one connection sends repeatedly, by index, and the maximum number of repetitions.
struct Attack {
  const char* name;
  int max;
  std::function<std::string(uint32_t i)> bytes;
};

const std::vector<Attack>& Attacks() {
  static const std::vector<Attack> attacks = {
      // CVE-2023-44487.
      {"RapidReset", 20'000,
       [](uint32_t i) {
         return Open(2 * i + 1) + FrameBytes(Frame::kResetStream, 0, 2 * i + 1, BigEndian(8));
       }},
      {"HalfOpenStreams", 1'000, [](uint32_t i) { return Open(2 * i + 1); }},
      // One call for each stream, without waiting for any answer.
      {"OpenStreams", 20'000,
       [](uint32_t i) {
         return FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, 2 * i + 1,
                           HeaderBlock(kCheckHealth));
       }},
      {"WindowUpdates", 2'000,
       [](uint32_t) {
         std::string frames;
         for (int i = 0; i < 100; ++i) {
           frames += FrameBytes(Frame::kWindowUpdate, 0, 0, BigEndian(1));
         }
         return frames;
       }},
      {"Continuations", 2'000,
       [](uint32_t i) {
         return FrameBytes(i == 0 ? Frame::kHeaders : Frame::kContinuation, 0, 1,
                           std::string(1024, '\x3f'));
       }},
      {"EmptyContinuations", 20'000,
       [](uint32_t i) {
         return i == 0 ? FrameBytes(Frame::kHeaders, 0, 1, HeaderBlock(kCheckHealth))
                       : FrameBytes(Frame::kContinuation, 0, 1, "");
       }},
      // CVE-2023-33953 and related: each byte of large blocks names an entry of the dynamic table.
      {"HeaderBombs", 2'000,
       [](uint32_t i) {
         const std::string entry = std::string("\x40\x01x\x7f\xa1\x1e", 6) + std::string(4000, 'v');
         const std::string block =
             HeaderBlock(kCheckHealth) + (i == 0 ? entry : std::string(12'000, '\xbe'));
         return FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, 2 * i + 1, block);
       }},
      {"Pings", 20'000, [](uint32_t) { return FrameBytes(Frame::kPing, 0, 0, "12345678"); }},
      {"Settings", 20'000, [](uint32_t) { return FrameBytes(Frame::kSettings, 0, 0, ""); }},
      {"NotHttp2", 1, [](uint32_t) { return std::string(1000, 'x'); }},
  };
  return attacks;
}

void ExpectAnswers(const std::string& address) {
  ClientOptions options;
  options.server = address;
  options.own_connection = true;
  const absl::Status health = Client(options).CheckHealth();
  EXPECT_TRUE(health.ok()) << health;
}

void RunAttack(const Attack& attack, const std::string& address) {
  SCOPED_TRACE(attack.name);
  Attacker attacker(address);
  ASSERT_TRUE(attacker.connected());
  bool open = std::string(attack.name) == "NotHttp2" || attacker.Send(kOpening);
  for (uint32_t i = 0; open && i < static_cast<uint32_t>(attack.max); ++i) {
    open = attacker.Send(attack.bytes(i));
  }
  attacker.AwaitEnd();
  ExpectAnswers(address);
}

TEST(Attacks, AConnectionThatAttacksIsClosed) {
  Process hulld({"--store", "memory", "--listen", "127.0.0.1:0"});
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  for (const Attack& attack : Attacks()) RunAttack(attack, address);
}

// gRPC logs metadata that it cannot parse.
TEST(Attacks, AClientCannotForgeLinesOfTheLog) {
  Process hulld({"--store", "memory", "--listen", "127.0.0.1:0"});
  Attacker attacker(AddressIn(hulld.ReadLineWith("listening on ")));
  ASSERT_TRUE(attacker.connected());
  const std::string name = "grpc-timeout";
  const std::string value = "1X\nforged \x1b[31m\xff";
  std::string block = HeaderBlock(kCheckHealth) + '\0';
  for (const std::string& text : {name, value}) block += static_cast<char>(text.size()) + text;
  ASSERT_TRUE(attacker.Send(
      kOpening + FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, 1, block)));
  EXPECT_THAT(hulld.ReadLineWith(name),
              testing::EndsWith("value=1X\\u000aforged \\u001b[31m\\ufffd\n"));
}

// By default gRPC closes the connection of an idle watch at the third ping within five minutes.
TEST(Attacks, AnIdleWatchMayPingEverySecond) {
  Process hulld({"--store", "memory", "--listen", "127.0.0.1:0"});
  Attacker client(AddressIn(hulld.ReadLineWith("listening on ")));
  ASSERT_TRUE(client.Send(
      kOpening +
      FrameBytes(Frame::kHeaders, kEndHeadersFlag, 1, HeaderBlock("/grpc.health.v1.Health/Watch")) +
      FrameBytes(Frame::kData, kEndStreamFlag, 1, MessageBytes(""))));
  for (int i = 0; i < 6; ++i) {
    // A longer pause changes nothing.
    std::this_thread::sleep_for(std::chrono::seconds(1));
    ASSERT_TRUE(client.Send(FrameBytes(Frame::kPing, 0, 0, "12345678"))) << i;
  }
}

// CVE-2023-4785: gRPC's own listener stops accepting after descriptors run out.
TEST(Attacks, ConnectionsThatExhaustTheDescriptorsAreSurvived) {
  for (const char* const listen : {"127.0.0.1:0", "[::]:0"}) {
    Process hulld("/bin/sh", {"-c", absl::StrCat("ulimit -n 64; exec ", HULLD_PROGRAM,
                                                 " --store memory --insecure --listen ", listen)});
    const std::string said = AddressIn(hulld.ReadLineWith("listening on "));
    const std::string address = absl::StrCat("127.0.0.1", said.substr(said.rfind(':')));
    {
      std::vector<Attacker> idle;
      for (int i = 0; i < 200; ++i) {
        idle.emplace_back(address);
        EXPECT_TRUE(idle.back().connected());
      }
    }
    ExpectAnswers(address);
  }
}

TEST(Attacks, IdleConnectionsAreClosedWhenDescriptorsRunOut) {
  Process hulld("/bin/sh", {"-c", absl::StrCat("ulimit -n 64; exec ", HULLD_PROGRAM,
                                               " --store memory --listen 127.0.0.1:0")});
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  std::vector<Attacker> idle;
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < 200; ++i) idle.emplace_back(address);
    ExpectAnswers(address);
  }
}

TEST(Attacks, ConnectionsPerAddressAreLimited) {
  Process hulld(
      {"--store", "memory", "--listen", "127.0.0.1:0", "--max-connections-per-address", "2"});
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  std::vector<Attacker> idle;
  for (int i = 0; i < 3; ++i) idle.emplace_back(address);
  idle.front().AwaitEnd();
  ExpectAnswers(address);
  idle[1].AwaitEnd();
}

class Front : public testing::Test {
 protected:
  void SetUp() override {
    if (access(kHaproxy, X_OK) != 0) GTEST_SKIP() << kHaproxy << " is not installed";
    hulld_ = std::make_unique<Process>(
        std::vector<std::string>{"--store", "memory", "--listen", "127.0.0.1:0"});
    std::ostringstream text;
    text << std::ifstream(SourceTree() / "docker/haproxy/front.cfg").rdbuf();
    settings_ = testing::TempDir() + absl::StrCat("front.", getpid(), ".cfg");
    std::ofstream(settings_) << absl::StrReplaceAll(
        text.str(), {{"bind :50551 ssl crt /etc/haproxy/hulld.pem alpn h2 ssl-min-ver TLSv1.2",
                      absl::StrCat("bind ", address_, " proto h2")},
                     {"unix@/run/hulld/socket", AddressIn(hulld_->ReadLineWith("listening on "))}});
    haproxy_ =
        std::make_unique<Process>(kHaproxy, std::vector<std::string>{"-db", "-f", settings_});
    // Until it listens, a connection is the only event to wait for.
    while (!Attacker(address_).connected()) {
    }
  }
  void TearDown() override {
    if (!settings_.empty()) std::remove(settings_.c_str());
  }

  const std::string address_ = UnusedAddress();
  std::unique_ptr<Process> hulld_;
  std::string settings_;
  std::unique_ptr<Process> haproxy_;
};

TEST_F(Front, AnswersAfterEachAttack) {
  for (const Attack& attack : Attacks()) {
    SCOPED_TRACE(attack.name);
    Attacker attacker(address_);
    ASSERT_TRUE(attacker.connected());
    bool open = attacker.Send(kOpening);
    // hulld, stopped, reads the attack and the call together: on a connection that haproxy shared
    // between them, gRPC would refuse the call with the attack's excess streams.
    hulld_->Signal(SIGSTOP);
    // A bounded part of it: haproxy may throttle such a client instead of closing it.
    for (uint32_t i = 0; open && i < 200; ++i) open = attacker.Send(attack.bytes(i));
    std::thread other([&] { ExpectAnswers(address_); });
    hulld_->Signal(SIGCONT);
    other.join();
  }
}

}  // namespace attacks_test
}  // namespace hulld::server
