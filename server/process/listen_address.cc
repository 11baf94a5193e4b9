#include "server/process/listen_address.h"

#include <absl/status/status.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <sys/un.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <cerrno>

#include "server/contract/errors.h"

namespace hulld::server {
namespace {

namespace asio = boost::asio;

bool IsPort(const std::string& text) {
  uint32_t port = 0;
  return text.find_first_not_of("0123456789") == std::string::npos &&
         absl::SimpleAtoi(text, &port) && port <= UINT16_MAX;
}

absl::Status Malformed(const char* flag, const std::string& text, const char* why) {
  return InvalidArgument(flag, " is \"", text, "\": ", why,
                         "; expected host:port, [v6]:port, or unix:path");
}

}  // namespace

bool ListenAddress::is_local() const {
  boost::system::error_code error;
  return is_unix() || host == "localhost" || asio::ip::make_address(host, error).is_loopback();
}

std::string ListenAddress::Format(int bound_port) const {
  if (is_unix()) return absl::StrCat("unix:", path);
  const bool v6 = host.find(':') != std::string::npos;
  return absl::StrCat(v6 ? "[" : "", host, v6 ? "]:" : ":", bound_port);
}

absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text, const char* flag) {
  ListenAddress address;
  if (text.starts_with("unix:")) {
    address.path = text.substr(5);
    if (address.path.starts_with("//")) address.path = address.path.substr(2);
    if (address.path.empty()) return Malformed(flag, text, "the socket has no path");
    if (address.path.size() >= sizeof(sockaddr_un::sun_path)) {
      return Malformed(flag, text, "the path of a unix socket must have at most 107 characters");
    }
    return address;
  }
  const size_t colon = text.rfind(':');
  if (colon == std::string::npos) return Malformed(flag, text, "the port is missing");
  address.host = text.substr(0, colon);
  address.port = text.substr(colon + 1);
  if (address.host.starts_with("[") && address.host.ends_with("]")) {
    address.host = address.host.substr(1, address.host.size() - 2);
  } else if (address.host.find(':') != std::string::npos) {
    return Malformed(flag, text, "an IPv6 address must be in brackets");
  }
  if (address.host.empty()) return Malformed(flag, text, "the host is missing");
  if (!IsPort(address.port)) return Malformed(flag, text, "the port is not a number up to 65535");
  return address;
}

absl::Status CheckExposure(const ListenAddress& address, bool has_tls, bool insecure) {
  if (has_tls || insecure || address.is_local()) return absl::OkStatus();
  return InvalidArgument(
      "--listen ", address.host, ":", address.port,
      " is reachable from other machines, and traffic, including tokens, would not be encrypted; "
      "encrypt it with --tls-cert and --tls-key, listen on 127.0.0.1, [::1] or "
      "unix:path, or allow it with --insecure");
}

absl::Status CheckSocketFree(const ListenAddress& address) {
  if (!address.is_unix()) return absl::OkStatus();
  asio::io_context context;
  asio::local::stream_protocol::socket socket(context);
  boost::system::error_code error;
  socket.connect(address.path, error);
  if (error) return absl::OkStatus();
  return Unavailable("cannot listen on unix:", address.path,
                     ": another server is listening; stop it or choose another path with --listen");
}

absl::Status BindFailure(const ListenAddress& address, int error, const std::string& cause,
                         const char* flag) {
  const std::string what = absl::StrCat(
      "cannot listen on ",
      address.is_unix() ? "unix:" + address.path : address.host + ":" + address.port, ": ");
  if (address.is_unix()) {
    return Unavailable(what, "check that the socket's directory exists and is writable");
  }
  if (error == EADDRINUSE) {
    return Unavailable(what,
                       "the port is in use; stop the other server or choose another port with ",
                       flag, " (port 0 picks a free one)");
  }
  const char* const advice =
      error == EACCES ? "choose a port above 1023 with " : "use an address of this machine with ";
  return Unavailable(what, cause, "; ", advice, flag);
}

}  // namespace hulld::server
