#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_SESSION_GUARD_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_SESSION_GUARD_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace hulld {

// A browser's request. Absent headers are empty.
struct PageRequest {
  std::string_view method;
  // Path and query, as in "/?token=...".
  std::string_view target;
  std::string_view host;
  std::string_view origin;
  std::string_view cookie;
  // True if it asks to upgrade to a WebSocket.
  bool upgrade = false;
};

// Controls access to the bridge. The bridge holds the user's hulld token, so pages of other sites
// in the user's browser, and other users of the machine, must be kept out:
// - Host must be exactly this address. This stops names that an attacker points at 127.0.0.1.
// - Origin, if present, must be this page's; a WebSocket must send it.
// - The address printed by hullctl contains a one-time token. It is exchanged for a cookie that no
//   script can read and that no request from another site carries.
// Not thread-safe.
class SessionGuard {
 public:
  // Uses secrets of 256 random bits. INTERNAL: the system returns no random bytes.
  static absl::StatusOr<SessionGuard> Create(uint16_t port);
  // Uses given secrets, for tests.
  SessionGuard(uint16_t port, std::string one_time_token, std::string session);

  enum class Verdict {
    // Serve the request.
    kServe,
    // Send the browser to "/" with SetCookie().
    kExchange,
    // Refuse the request with `http_status` and `reason`.
    kRefuse,
  };
  struct Decision {
    Verdict verdict = Verdict::kRefuse;
    int http_status = 0;
    // The problem and its remedy, for people.
    std::string reason;
  };
  // Decides on a request. kExchange consumes the one-time token.
  Decision Judge(const PageRequest& request);

  // Returns the address to open, with the one-time token.
  std::string Address() const;
  // Returns "127.0.0.1:PORT".
  std::string Host() const;
  // Returns the value of the header Set-Cookie.
  std::string SetCookie() const;

 private:
  bool HasSession(std::string_view cookies) const;

  uint16_t port_;
  // Empty after its use.
  std::string one_time_token_;
  std::string session_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_SESSION_GUARD_H_
