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

// Channel to one open page. Thread-safe.
class PageChannel {
 public:
  virtual ~PageChannel() = default;
  // Sends a message. Blocks while more than BridgeOptions::max_queued_bytes are pending for the
  // page, so that a slow page has bounded memory. Returns false if the page has closed.
  virtual bool SendText(std::string json) = 0;
  virtual bool SendBinary(std::string frame) = 0;
};

// Handles the messages of a page. Destroyed after the page has closed; the destructor may wait for
// threads that send, because sending no longer blocks then.
class PageHandler {
 public:
  virtual ~PageHandler() = default;
  // Called by the bridge's thread, never concurrently. Must not block.
  virtual void OnMessage(std::string_view json) = 0;
};

struct BridgeOptions {
  // 0: any free port.
  uint16_t port = 0;
  // Maximum number of connections. At the limit, a new connection replaces the longest idle one;
  // without an idle one, it is closed. A page needs one permanently and several while it loads.
  size_t max_connections = 32;
  // Maximum size of a message from a page; a page that exceeds it is disconnected.
  size_t max_message_bytes = size_t{4} << 20;
  size_t max_queued_bytes = size_t{64} << 20;
  // Called by the bridge's thread when a page connects.
  std::function<std::unique_ptr<PageHandler>(std::shared_ptr<PageChannel>)> open_page;
};

// Serves the viewer's page over HTTP on 127.0.0.1, and one WebSocket to each page. Access control:
// session_guard.h. Runs on its own thread. This header does not include Boost.Beast, which takes
// many seconds to compile.
class Bridge {
 public:
  // INVALID_ARGUMENT: cannot listen on the port.
  static absl::StatusOr<std::unique_ptr<Bridge>> Start(BridgeOptions options);
  // Closes every connection.
  virtual ~Bridge() = default;

  // Returns the address to open in a browser; valid for one use.
  virtual std::string Address() const = 0;
  virtual uint16_t port() const = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_BRIDGE_H_
