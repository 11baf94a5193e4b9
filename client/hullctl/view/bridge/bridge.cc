#include "client/hullctl/view/bridge/bridge.h"

#include <absl/strings/str_cat.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <list>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "client/hullctl/view/bridge/page_html.h"
#include "client/hullctl/view/bridge/random_name.h"
#include "client/hullctl/view/bridge/session_guard.h"

namespace hulld {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;
using tcp = boost::asio::ip::tcp;

constexpr uint32_t kMaxHeaderBytes = 16 << 10;
constexpr std::chrono::seconds kRequestTimeout{20};
constexpr size_t kNonceBytes = 16;

std::string_view ViewOf(beast::string_view text) { return {text.data(), text.size()}; }

class PageConnection;
class HttpConnection;

// State shared by all connections. Used by the io thread only, and by the destructor after that
// thread has ended.
struct Shared {
  Shared(BridgeOptions given_options, SessionGuard given_guard)
      : options(std::move(given_options)), guard(std::move(given_guard)) {}

  BridgeOptions options;
  SessionGuard guard;
  size_t connections = 0;
  // Connections that await a request, the longest waiting first.
  std::list<HttpConnection*> awaiting;
  std::thread::id io_thread;
  std::vector<std::weak_ptr<PageConnection>> pages;
  // Threads that destroy the handlers of closed pages. The destruction waits for the handler's
  // threads, which may be waiting for an answer from hulld, and must not delay other pages.
  std::vector<std::thread> reapers;
};

// Counts a connection during its lifetime.
class OpenCount {
 public:
  explicit OpenCount(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {
    ++shared_->connections;
  }
  ~OpenCount() { --shared_->connections; }
  OpenCount(const OpenCount&) = delete;
  OpenCount& operator=(const OpenCount&) = delete;

 private:
  std::shared_ptr<Shared> shared_;
};

// The WebSocket of a page. Handlers run on the io thread; SendText and SendBinary on any.
class PageConnection final : public PageChannel,
                             public std::enable_shared_from_this<PageConnection> {
 public:
  PageConnection(beast::tcp_stream stream, std::shared_ptr<Shared> shared,
                 std::unique_ptr<OpenCount> counted)
      : socket_(std::move(stream)), shared_(std::move(shared)), counted_(std::move(counted)) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(shared_->options.max_message_bytes);
    socket_.auto_fragment(false);
  }

  void Accept(const http::request<http::empty_body>& request) {
    beast::get_lowest_layer(socket_).expires_never();
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return self->Close();
      self->shared_->pages.push_back(self);
      self->handler_ = self->shared_->options.open_page(self);
      self->Read();
    });
  }

  bool SendText(std::string json) override { return Enqueue({std::move(json), true}); }
  bool SendBinary(std::string frame) override { return Enqueue({std::move(frame), false}); }

  // Closes the connection and drops pending messages.
  void Close() {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(closed_, true)) return;
    }
    room_.notify_all();
    beast::get_lowest_layer(socket_).close();
    counted_.reset();
    if (!handler_) return;
    shared_->reapers.emplace_back([handler = std::move(handler_)]() mutable { handler.reset(); });
  }

 private:
  struct Message {
    std::string bytes;
    bool text;
  };

  bool Enqueue(Message message) {
    std::unique_lock lock(mutex_);
    // The io thread writes the queue, so it must not wait for itself.
    if (std::this_thread::get_id() != shared_->io_thread) {
      room_.wait(lock,
                 [this] { return closed_ || queued_bytes_ <= shared_->options.max_queued_bytes; });
    }
    if (closed_) return false;
    queued_bytes_ += message.bytes.size();
    queue_.push_back(std::move(message));
    if (queue_.size() > 1) return true;
    lock.unlock();
    asio::post(socket_.get_executor(), [self = shared_from_this()] { self->Write(); });
    return true;
  }

  void Read() {
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, size_t /*size*/) {
      if (error) return self->Close();
      const auto bytes = self->buffer_.cdata();
      if (self->socket_.got_text()) {
        self->handler_->OnMessage({static_cast<const char*>(bytes.data()), bytes.size()});
      }
      self->buffer_.consume(self->buffer_.size());
      self->Read();
    });
  }

  void Write() {
    const std::lock_guard lock(mutex_);
    if (closed_ || queue_.empty()) return;
    // References to elements of a deque stay valid when elements are added at its end.
    const Message& message = queue_.front();
    socket_.text(message.text);
    socket_.async_write(asio::buffer(message.bytes),
                        [self = shared_from_this()](error_code error, size_t /*size*/) {
                          if (error) return self->Close();
                          self->OnWritten();
                        });
  }

  void OnWritten() {
    bool more;
    {
      const std::lock_guard lock(mutex_);
      queued_bytes_ -= queue_.front().bytes.size();
      queue_.pop_front();
      more = !queue_.empty();
    }
    room_.notify_all();
    if (more) Write();
  }

  websocket::stream<beast::tcp_stream> socket_;
  const std::shared_ptr<Shared> shared_;
  std::unique_ptr<OpenCount> counted_;
  std::unique_ptr<PageHandler> handler_;
  beast::flat_buffer buffer_;

  std::mutex mutex_;
  std::condition_variable room_;
  // Guarded by the mutex. The front message is being written.
  std::deque<Message> queue_;
  size_t queued_bytes_ = 0;
  bool closed_ = false;
};

// One HTTP connection, until it ends or becomes a WebSocket.
class HttpConnection final : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(tcp::socket socket, std::shared_ptr<Shared> shared)
      : stream_(std::move(socket)),
        shared_(std::move(shared)),
        counted_(std::make_unique<OpenCount>(shared_)) {}
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  ~HttpConnection() { shared_->awaiting.remove(this); }

  // Closes this idle connection to make room for a new one.
  void MakeRoom() {
    shared_->awaiting.remove(this);
    counted_.reset();
    stream_.close();
  }

  void Read() {
    shared_->awaiting.push_back(this);
    parser_.emplace();
    parser_->header_limit(kMaxHeaderBytes);
    parser_->body_limit(0);
    stream_.expires_after(kRequestTimeout);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, size_t /*size*/) {
                       self->shared_->awaiting.remove(self.get());
                       // An uncounted connection was closed by MakeRoom.
                       if (!error && self->counted_) self->Answer();
                     });
  }

 private:
  using Request = http::request<http::empty_body>;
  using Response = http::response<http::string_body>;

  void Answer() {
    const Request& request = parser_->get();
    const bool upgrade = websocket::is_upgrade(request);
    const auto header = [&request](http::field field) { return ViewOf(request[field]); };
    const SessionGuard::Decision decision = shared_->guard.Judge(
        {ViewOf(request.method_string()), ViewOf(request.target()), header(http::field::host),
         header(http::field::origin), header(http::field::cookie), upgrade});
    switch (decision.verdict) {
      case SessionGuard::Verdict::kRefuse:
        return Send(Text(decision.http_status, decision.reason + "\n"));
      case SessionGuard::Verdict::kExchange: {
        // A redirect would not work: a browser sent here by another program or site would omit the
        // cookie from it. The refresh is a request from our own page.
        Response response = Text(decision.http_status,
                                 "<!doctype html><meta http-equiv=\"refresh\" content=\"0; url=/\">"
                                 "<title>hulld</title>\n");
        response.set(http::field::content_type, std::string(MediaTypeOf("index.html")));
        response.set(http::field::set_cookie, shared_->guard.SetCookie());
        return Send(std::move(response));
      }
      case SessionGuard::Verdict::kServe:
        break;
    }
    if (!upgrade) return Send(FileResponse(ViewOf(request.target())));
    if (request.target() != "/page") return Send(Text(404, "The WebSocket is at /page.\n"));
    std::make_shared<PageConnection>(std::move(stream_), shared_, std::move(counted_))
        ->Accept(request);
  }

  Response Text(int status, const std::string& body) const {
    Response response(http::int_to_status(static_cast<unsigned>(status)), parser_->get().version());
    response.set(http::field::content_type, "text/plain; charset=utf-8");
    response.set("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Cross-Origin-Opener-Policy", "same-origin");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    response.set(http::field::cache_control, "no-store");
    response.body() = body;
    return response;
  }

  Response FileResponse(std::string_view target) const {
    if (target == "/") {
      const auto nonce = RandomHex(kNonceBytes);
      if (!nonce.ok()) return Text(500, std::string(nonce.status().message()) + "\n");
      Response response = Text(200, ServedPage(*nonce));
      response.set(http::field::content_type, std::string(MediaTypeOf("index.html")));
      response.set("Content-Security-Policy",
                   ServedPagePolicy(*nonce, ViewOf(parser_->get()[http::field::host])));
      return response;
    }
    const PageFile* const file = FindPageFile(target.substr(1));
    if (file == nullptr || file->name == "index.html") return Text(404, "There is no such file.\n");
    Response response = Text(200, std::string(file->bytes));
    response.set(http::field::content_type, std::string(MediaTypeOf(file->name)));
    return response;
  }

  void Send(Response response) {
    response.keep_alive(parser_->get().keep_alive());
    response.prepare_payload();
    if (parser_->get().method() == http::verb::head) response.body().clear();
    auto owned = std::make_shared<Response>(std::move(response));
    stream_.expires_after(kRequestTimeout);
    http::async_write(stream_, *owned,
                      [self = shared_from_this(), owned](error_code error, size_t /*size*/) {
                        if (error || !owned->keep_alive()) return self->End();
                        self->Read();
                      });
  }

  void End() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  beast::tcp_stream stream_;
  const std::shared_ptr<Shared> shared_;
  std::unique_ptr<OpenCount> counted_;
  beast::flat_buffer buffer_{kMaxHeaderBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
};

class BeastBridge final : public Bridge {
 public:
  explicit BeastBridge(uint16_t port)
      : acceptor_(context_, tcp::endpoint(asio::ip::address_v4::loopback(), port)),
        port_(acceptor_.local_endpoint().port()) {}

  ~BeastBridge() override {
    context_.stop();
    if (!thread_.joinable()) return;
    thread_.join();
    for (const auto& page : shared_->pages) {
      if (const auto open = page.lock()) open->Close();
    }
    for (std::thread& reaper : shared_->reapers) reaper.join();
  }

  void Run(BridgeOptions options, SessionGuard guard) {
    address_ = guard.Address();
    shared_ = std::make_shared<Shared>(std::move(options), std::move(guard));
    Accept();
    thread_ = std::thread([this] {
      shared_->io_thread = std::this_thread::get_id();
      context_.run();
    });
  }

  std::string Address() const override { return address_; }
  uint16_t port() const override { return port_; }

 private:
  void Accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      // Idle connections must not block the page.
      if (shared_->connections >= shared_->options.max_connections && !shared_->awaiting.empty()) {
        shared_->awaiting.front()->MakeRoom();
      }
      if (!error && shared_->connections < shared_->options.max_connections) {
        error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        std::make_shared<HttpConnection>(std::move(socket), shared_)->Read();
      }
      Accept();
    });
  }

  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  const uint16_t port_;
  std::string address_;
  std::shared_ptr<Shared> shared_;
  std::thread thread_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Bridge>> Bridge::Start(BridgeOptions options) {
  std::unique_ptr<BeastBridge> bridge;
  try {
    bridge = std::make_unique<BeastBridge>(options.port);
  } catch (const boost::system::system_error& error) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot listen on 127.0.0.1:", options.port, " (", error.code().message(),
                     "); choose another --port, or 0 for any free one"));
  }
  auto guard = SessionGuard::Create(bridge->port());
  if (!guard.ok()) return guard.status();
  bridge->Run(std::move(options), *std::move(guard));
  return bridge;
}

}  // namespace hulld
