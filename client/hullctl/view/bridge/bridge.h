#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_BRIDGE_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_BRIDGE_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace hulld {

// The way to one open page. Any thread may call it.
class PageChannel {
 public:
  virtual ~PageChannel() = default;
  // Sends a message. Waits while more than BridgeOptions::max_queued_bytes wait for the page, so
  // that a slow page costs no memory. False when the page has gone.
  virtual bool SendText(std::string json) = 0;
  virtual bool SendBinary(std::string frame) = 0;
};

// What takes the messages of one page. Destroyed when the page has gone; the destructor may wait
// for threads that send, as sending no longer waits then.
class PageHandler {
 public:
  virtual ~PageHandler() = default;
  // Called one at a time, by the bridge's thread: must not wait.
  virtual void OnMessage(std::string_view json) = 0;
};

struct BridgeOptions {
  // 0: any free one.
  uint16_t port = 0;
  // Connections at once; more are closed. A page takes one that stays and some while it loads.
  size_t max_connections = 32;
  // The most bytes of one message of a page; a page that sends more is disconnected.
  size_t max_message_bytes = size_t{4} << 20;
  size_t max_queued_bytes = size_t{64} << 20;
  // Called when a page connects, by the bridge's thread.
  std::function<std::unique_ptr<PageHandler>(std::shared_ptr<PageChannel>)> open_page;
};

// Serves the viewer's page over HTTP on 127.0.0.1, and one WebSocket to each page. Who may ask:
// session_guard.h. Runs on one thread of its own. Includes nothing of Boost.Beast here: its headers
// take many seconds to compile.
class Bridge {
 public:
  // INVALID_ARGUMENT: the port cannot be listened on.
  static absl::StatusOr<std::unique_ptr<Bridge>> Start(BridgeOptions options);
  // Closes every connection.
  virtual ~Bridge() = default;

  // What to open in a browser; works once.
  virtual std::string Address() const = 0;
  virtual uint16_t port() const = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_BRIDGE_H_
