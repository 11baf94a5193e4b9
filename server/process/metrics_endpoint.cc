#include "server/process/metrics_endpoint.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/http/verb.hpp>
#include <chrono>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/process/listen_address.h"

namespace hulld::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;
using tcp = boost::asio::ip::tcp;

constexpr char kFlag[] = "--metrics-address";
// Enough for a few scrapers and manual queries. A further connection replaces the one that has been
// in its current state, waiting for a request or for its reply to be read, for the longest time.
constexpr size_t kMaxConnections = 64;
constexpr uint32_t kMaxHeaderBytes = 8 << 10;
// Timeout for receiving a request, and for sending its reply.
constexpr std::chrono::seconds kTimeout{20};
// Pause after running out of descriptors.
constexpr std::chrono::milliseconds kAcceptPause{100};

// A connection. Owns itself while an operation is pending.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  // The open connections, by the time of their last state change.
  using List = std::list<Connection*>;

  Connection(tcp::socket socket, const Metrics& metrics, List& open)
      : stream_(std::move(socket)),
        metrics_(metrics),
        open_(open),
        place_(open.insert(open.end(), this)) {}
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { Leave(); }

  void Read() {
    Expire();
    asio::async_read_until(stream_, asio::dynamic_buffer(input_, kMaxHeaderBytes), "\r\n\r\n",
                           [self = shared_from_this()](error_code error, size_t size) {
                             if (!error) self->Answer(size);
                           });
  }

  // Ends the pending operation.
  void Close() {
    Leave();
    stream_.close();
  }

 private:
  void Leave() {
    if (place_.has_value()) open_.erase(*std::exchange(place_, std::nullopt));
  }

  // Starts the timeout of the next operation.
  void Expire() {
    stream_.expires_after(kTimeout);
    if (place_.has_value()) open_.splice(open_.end(), open_, *place_);
  }

  // Answers the request whose header is the first `size` bytes of input. A body is not read: it
  // ends the connection.
  void Answer(size_t size) {
    http::request_parser<http::empty_body> parser;
    parser.skip(true);
    error_code error;
    parser.put(asio::buffer(input_.data(), size), error);
    input_.erase(0, size);
    const auto& request = parser.get();
    const bool is_head = request.method() == http::verb::head;
    beast::string_view path = request.target().substr(0, request.target().find('?'));
    // Proxies may name the whole URL.
    constexpr beast::string_view kScheme = "http://";
    if (path.starts_with(kScheme)) {
      path.remove_prefix(std::min(path.find('/', kScheme.size()), path.size()));
    }
    http::status status = http::status::ok;
    std::string body;
    if (error) {
      status = http::status::bad_request;
      body = absl::StrCat("Malformed HTTP request: ", error.message(), ".\n");
    } else if (!is_head && request.method() != http::verb::get) {
      status = http::status::method_not_allowed;
      body = "Only GET is served.\n";
    } else if (path != "/metrics") {
      status = http::status::not_found;
      body = "Metrics are at /metrics.\n";
    } else {
      body = prometheus::TextSerializer().Serialize(metrics_.Collect());
    }
    const bool has_body = request.chunked() || (request.has_content_length() &&
                                                request[http::field::content_length] != "0");
    const bool keep_alive = !error && !has_body && request.keep_alive();
    const beast::string_view reason = http::obsolete_reason(status);
    reply_ = absl::StrCat(
        "HTTP/1.1 ", static_cast<unsigned>(status), " ",
        absl::string_view(reason.data(), reason.size()),
        "\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\nAllow: GET, HEAD\r\n",
        "Connection: ", keep_alive ? "keep-alive" : "close", "\r\nContent-Length: ", body.size(),
        "\r\n\r\n", is_head ? "" : body);
    Expire();
    asio::async_write(stream_, asio::buffer(reply_),
                      [self = shared_from_this(), keep_alive](error_code failure, size_t /*size*/) {
                        if (!failure && keep_alive) return self->Read();
                        error_code ignored;
                        self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
                      });
  }

  beast::tcp_stream stream_;
  const Metrics& metrics_;
  List& open_;
  // None after Close.
  std::optional<List::iterator> place_;
  std::string input_;
  std::string reply_;
};

// The port and its thread. All functions except constructor and destructor run on that thread.
class Listener : public MetricsEndpoint {
 public:
  explicit Listener(const Metrics& metrics) : metrics_(metrics) {}
  ~Listener() override {
    context_.stop();
    if (thread_.joinable()) thread_.join();
  }

  // UNAVAILABLE: the port cannot be bound.
  absl::Status Listen(const ListenAddress& address) {
    error_code error;
    const auto found =
        tcp::resolver(context_).resolve(address.host, address.port, tcp::resolver::passive, error);
    if (error || found.empty()) return BindFailure(address, 0, error.message(), kFlag);
    const tcp::endpoint endpoint = *found.begin();
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(tcp::acceptor::max_listen_connections, error);
    if (error) return BindFailure(address, error.value(), error.message(), kFlag);
    Accept();
    thread_ = std::thread([this] { context_.run(); });
    address_ = address.Format(acceptor_.local_endpoint().port());
    return absl::OkStatus();
  }

 private:
  void Accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (error) {
        pause_.expires_after(kAcceptPause);
        return pause_.async_wait([this](error_code) { Accept(); });
      }
      if (open_.size() >= kMaxConnections) open_.front()->Close();
      std::make_shared<Connection>(std::move(socket), metrics_, open_)->Read();
      Accept();
    });
  }

  const Metrics& metrics_;
  Connection::List open_;
  // Destroys the remaining connections, which update the list.
  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  asio::steady_timer pause_{context_};
  std::thread thread_;
};

}  // namespace

absl::StatusOr<ListenAddress> ParseMetricsAddress(const std::string& address, bool exposed) {
  HULLD_ASSIGN_OR_RETURN(ListenAddress parsed, ParseListenAddress(address, kFlag));
  if (parsed.is_unix()) {
    return InvalidArgument(kFlag, " is \"", address, "\": it must be a TCP address, host:port");
  }
  if (!parsed.is_local() && !exposed) {
    return InvalidArgument(
        kFlag, " is \"", address,
        "\", which is reachable from other machines, and metrics are neither ",
        "encrypted nor authenticated; use 127.0.0.1, or allow it with --metrics-insecure");
  }
  return parsed;
}

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Start(const std::string& address,
                                                                        bool exposed,
                                                                        const Metrics& metrics) {
  HULLD_ASSIGN_OR_RETURN(const ListenAddress parsed, ParseMetricsAddress(address, exposed));
  auto listener = std::make_unique<Listener>(metrics);
  HULLD_RETURN_IF_ERROR(listener->Listen(parsed));
  return listener;
}

}  // namespace hulld::server
