// The bridge over real connections, with raw bytes as sent by browsers and attackers.
#include "client/hullctl/view/bridge/bridge.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "client/hullctl/view/bridge/page_html.h"

namespace hulld {
namespace bridge_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class Socket {
 public:
  explicit Socket(uint16_t port) : descriptor_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  ~Socket() { close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  void Send(const std::string& bytes) {
    static_cast<void>(send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL));
  }
  // Reads until the peer closes.
  std::string ReadAll() {
    while (ReadSome()) {
    }
    return received_;
  }
  // Reads until the text arrives. Returns false if the peer closes first.
  bool ReadUntil(const std::string& text) {
    while (received_.find(text) == std::string::npos) {
      if (!ReadSome()) return false;
    }
    return true;
  }

 private:
  bool ReadSome() {
    char buffer[4096];
    const ssize_t size = recv(descriptor_, buffer, sizeof(buffer), 0);
    if (size <= 0) return false;
    received_.append(buffer, static_cast<size_t>(size));
    return true;
  }

  int descriptor_;
  std::string received_;
};

class EchoHandler final : public PageHandler {
 public:
  explicit EchoHandler(std::shared_ptr<PageChannel> page) : page_(std::move(page)) {}
  void OnMessage(std::string_view json) override { page_->SendText("echo " + std::string(json)); }

 private:
  std::shared_ptr<PageChannel> page_;
};

class BridgeTest : public ::testing::Test {
 protected:
  void SetUp() override { Start({}); }

  void Start(BridgeOptions options) {
    options.open_page = [](std::shared_ptr<PageChannel> page) {
      return std::make_unique<EchoHandler>(std::move(page));
    };
    auto bridge = Bridge::Start(std::move(options));
    ASSERT_TRUE(bridge.ok()) << bridge.status();
    bridge_ = *std::move(bridge);
    host_ = "127.0.0.1:" + std::to_string(bridge_->port());
  }

  std::string Get(const std::string& target, const std::string& headers = "",
                  const std::string& method = "GET") {
    Socket socket(bridge_->port());
    socket.Send(method + " " + target + " HTTP/1.1\r\nHost: " + host_ +
                "\r\nConnection: close\r\n" + headers + "\r\n");
    return socket.ReadAll();
  }

  // Exchanges the token address for a session; returns the Cookie header.
  std::string ComeIn() {
    const std::string address = bridge_->Address();
    const std::string answer = Get(address.substr(address.find("/?")));
    const size_t at = answer.find("Set-Cookie: ");
    EXPECT_NE(at, std::string::npos) << answer;
    const size_t begin = at + std::string("Set-Cookie: ").size();
    return "Cookie: " + answer.substr(begin, answer.find(';', begin) - begin) + "\r\n";
  }

  std::string UpgradeRequest(const std::string& cookie, const std::string& origin) const {
    return "GET /page HTTP/1.1\r\nHost: " + host_ + "\r\nOrigin: " + origin +
           "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
           cookie + "\r\n";
  }

  std::unique_ptr<Bridge> bridge_;
  std::string host_;
};

// Returns a client's text frame that announces `size` bytes, masked with zeros (RFC 6455, section
// 5.2).
std::string TextFrame(const std::string& text, uint64_t size) {
  const int length_bytes = size < 126 ? 0 : size < 65536 ? 2 : 8;
  const uint64_t code = length_bytes == 0 ? size : length_bytes == 2 ? 126 : 127;
  std::string frame = "\x81";
  frame += static_cast<char>(0x80 | code);
  for (int i = length_bytes - 1; i >= 0; --i) frame += static_cast<char>(size >> (8 * i) & 0xff);
  return frame + std::string(4, '\0') + text;
}

TEST_F(BridgeTest, PagePolicyAllowsOnlyItsOwnFiles) {
  const std::string cookie = ComeIn();
  const std::string page = Get("/", cookie);
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(page, HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self' "));
  EXPECT_THAT(page, HasSubstr("connect-src ws://" + host_ + ";"));
  EXPECT_THAT(page, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(page, HasSubstr("Cross-Origin-Resource-Policy: same-origin"));
  EXPECT_THAT(page, HasSubstr("<script type=\"module\" src=\"/main.js\">"));
  for (const PageFile& file : PageFiles()) {
    if (file.name == "index.html") continue;
    EXPECT_THAT(Get("/" + std::string(file.name), cookie),
                AllOf(StartsWith("HTTP/1.1 200"), HasSubstr(std::string(MediaTypeOf(file.name)))))
        << file.name;
  }
  for (const char* target : {"/index.html", "/../style.css", "/etc/passwd", "/three/", "/page"}) {
    EXPECT_THAT(Get(target, cookie), StartsWith("HTTP/1.1 404")) << target;
  }
}

TEST_F(BridgeTest, ClientsWithoutASessionGetNothing) {
  EXPECT_THAT(Get("/"), AllOf(StartsWith("HTTP/1.1 403"), Not(HasSubstr("<script"))));
  EXPECT_THAT(Get("/style.css"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Get("/?token=0"), StartsWith("HTTP/1.1 403"));
  const std::string cookie = ComeIn();
  EXPECT_THAT(Get("/", cookie, "POST"), StartsWith("HTTP/1.1 405"));
  const std::string own_host = host_;
  host_ = "evil.example:" + std::to_string(bridge_->port());
  EXPECT_THAT(Get("/", cookie), StartsWith("HTTP/1.1 421"));
  host_ = own_host;
  EXPECT_THAT(Get("/", cookie), StartsWith("HTTP/1.1 200"));
}

TEST_F(BridgeTest, AddressWorksOnce) {
  ComeIn();
  const std::string address = bridge_->Address();
  EXPECT_THAT(Get(address.substr(address.find("/?"))), StartsWith("HTTP/1.1 403"));
}

TEST_F(BridgeTest, OnlyThePagesOwnWebSocketIsServed) {
  const std::string cookie = ComeIn();
  Socket page(bridge_->port());
  page.Send(UpgradeRequest(cookie, "http://" + host_));
  ASSERT_TRUE(page.ReadUntil("HTTP/1.1 101"));
  page.Send(TextFrame("hello", 5));
  EXPECT_TRUE(page.ReadUntil("echo hello"));

  Socket foreign(bridge_->port());
  foreign.Send(UpgradeRequest(cookie, "http://evil.example"));
  EXPECT_TRUE(foreign.ReadUntil("HTTP/1.1 403"));
  Socket stranger(bridge_->port());
  stranger.Send(UpgradeRequest("", "http://" + host_));
  EXPECT_TRUE(stranger.ReadUntil("HTTP/1.1 403"));
}

TEST_F(BridgeTest, MessagesBeyondTheLimitEndTheConnection) {
  BridgeOptions options;
  options.max_message_bytes = 1000;
  Start(std::move(options));
  const std::string cookie = ComeIn();
  Socket page(bridge_->port());
  page.Send(UpgradeRequest(cookie, "http://" + host_));
  ASSERT_TRUE(page.ReadUntil("HTTP/1.1 101"));
  page.Send(TextFrame(std::string(900, 'x'), 900));
  ASSERT_TRUE(page.ReadUntil("echo x"));
  // The announced size alone exceeds the limit, before any payload arrives.
  page.Send(TextFrame("", uint64_t{1} << 40));
  EXPECT_FALSE(page.ReadUntil("never said"));
}

TEST_F(BridgeTest, RequestsBeyondTheLimitsAreDropped) {
  Socket socket(bridge_->port());
  socket.Send("GET / HTTP/1.1\r\nHost: " + host_ + "\r\nX: " + std::string(40000, 'x'));
  EXPECT_EQ(socket.ReadAll(), "");
}

TEST_F(BridgeTest, IdleConnectionsAreClosedInFavorOfThePage) {
  BridgeOptions options;
  options.max_connections = 2;
  Start(std::move(options));
  Socket silent(bridge_->port());
  Socket unfinished(bridge_->port());
  unfinished.Send("GET / HT");
  std::vector<std::unique_ptr<Socket>> open;
  for (int i = 0; i < 4; ++i) {
    open.push_back(std::make_unique<Socket>(bridge_->port()));
    open.back()->Send("GET / HTTP/1.1\r\nHost: " + host_ + "\r\n\r\n");
    ASSERT_TRUE(open.back()->ReadUntil("\r\n\r\n"));
  }
  EXPECT_EQ(silent.ReadAll(), "");
  EXPECT_EQ(unfinished.ReadAll(), "");
}

TEST_F(BridgeTest, PagesBeyondTheLimitAreClosed) {
  BridgeOptions options;
  options.max_connections = 2;
  Start(std::move(options));
  const std::string cookie = ComeIn();
  std::vector<std::unique_ptr<Socket>> pages;
  for (int i = 0; i < 2; ++i) {
    pages.push_back(std::make_unique<Socket>(bridge_->port()));
    pages.back()->Send(UpgradeRequest(cookie, "http://" + host_));
    ASSERT_TRUE(pages.back()->ReadUntil("HTTP/1.1 101"));
  }
  Socket third(bridge_->port());
  EXPECT_EQ(third.ReadAll(), "");
}

TEST_F(BridgeTest, APortInUseIsNamed) {
  BridgeOptions options;
  options.port = bridge_->port();
  const auto second = Bridge::Start(std::move(options));
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("choose another --port"));
}

TEST_F(BridgeTest, ShutsDownWhilePagesAreOpen) {
  const std::string cookie = ComeIn();
  Socket page(bridge_->port());
  page.Send(UpgradeRequest(cookie, "http://" + host_));
  ASSERT_TRUE(page.ReadUntil("HTTP/1.1 101"));
  bridge_.reset();
  EXPECT_FALSE(page.ReadUntil("never said"));
}

TEST(StandalonePage, IsSelfContained) {
  const std::string recording = "{\"note\":\"</script><script>alert(1)\"}";
  const std::string page = StandalonePage(recording);
  // The page is too long to print on failure.
  const auto holds = [&page](const char* text) { return page.find(text) != std::string::npos; };
  EXPECT_TRUE(holds("default-src 'none'"));
  EXPECT_TRUE(holds("id=\"recording\""));
  EXPECT_FALSE(holds("<script src="));
  EXPECT_FALSE(holds("<link"));
  // Data cannot terminate the enclosing script element.
  EXPECT_FALSE(holds("</script><script>alert"));
  // A picture is the page without its panels.
  EXPECT_TRUE(holds("\n<body>\n"));
  const std::string picture = PicturePage(recording, {800, 600});
  EXPECT_NE(picture.find("\n<body class=\"picture\" style=\"--width: 800px"), std::string::npos);
}

}  // namespace bridge_test
}  // namespace hulld
