#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_SESSION_GUARD_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_SESSION_GUARD_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace hulld {

// What a browser says when it asks for something. Absent headers are empty.
struct PageRequest {
  std::string_view method;
  // Path and query, as in "/?token=...".
  std::string_view target;
  std::string_view host;
  std::string_view origin;
  std::string_view cookie;
  // Whether it asks to become a WebSocket.
  bool upgrade = false;
};

// Decides who may talk to the bridge. The bridge holds the user's token of hulld, so that any page
// of any site in the user's browser, and any other user of the machine, must be kept out:
//  - Host must be this very address, which stops names that an attacker points at 127.0.0.1.
//  - Origin, where it is given, must be this page's; a WebSocket must give it.
//  - The address that hullctl prints holds a token that works once. It is exchanged for a cookie
//    that no script can read and that no request of another site carries.
// Not safe for use by several threads.
class SessionGuard {
 public:
  // With secrets of 256 random bits. INTERNAL: the system gives no random bytes.
  static absl::StatusOr<SessionGuard> Create(uint16_t port);
  // With given secrets, for tests.
  SessionGuard(uint16_t port, std::string one_time_token, std::string session);

  enum class Verdict {
    // Answer it.
    kServe,
    // Send the browser to "/", and give it SetCookie().
    kExchange,
    // Refuse it with `http_status` and `reason`.
    kRefuse,
  };
  struct Decision {
    Verdict verdict = Verdict::kRefuse;
    int http_status = 0;
    // For people: what is wrong and what to do.
    std::string reason;
  };
  // kExchange uses the one-time token up.
  Decision Judge(const PageRequest& request);

  // The address to open, with the one-time token.
  std::string Address() const;
  // "127.0.0.1:PORT".
  std::string Host() const;
  // The value of the header Set-Cookie.
  std::string SetCookie() const;

 private:
  bool HasSession(std::string_view cookies) const;

  uint16_t port_;
  // Empty once it was used.
  std::string one_time_token_;
  std::string session_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_SESSION_GUARD_H_
