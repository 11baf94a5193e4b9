#include "client/hullctl/view/bridge/session_guard.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>
#include <openssl/crypto.h>

#include <utility>

#include "client/base/status_macros.h"
#include "client/hullctl/view/bridge/random_name.h"

namespace hulld {
namespace {

constexpr size_t kSecretBytes = 32;
constexpr std::string_view kTokenTarget = "/?token=";

// Compares in time independent of the first difference.
bool IsSame(std::string_view given, std::string_view secret) {
  return given.size() == secret.size() && !secret.empty() &&
         CRYPTO_memcmp(given.data(), secret.data(), secret.size()) == 0;
}

SessionGuard::Decision RefuseRequest(int http_status, std::string reason) {
  return {SessionGuard::Verdict::kRefuse, http_status, std::move(reason)};
}

}  // namespace

absl::StatusOr<SessionGuard> SessionGuard::Create(uint16_t port) {
  HULLD_ASSIGN_OR_RETURN(auto token, RandomHex(kSecretBytes));
  HULLD_ASSIGN_OR_RETURN(auto session, RandomHex(kSecretBytes));
  return SessionGuard(port, std::move(token), std::move(session));
}

SessionGuard::SessionGuard(uint16_t port, std::string one_time_token, std::string session)
    : port_(port), one_time_token_(std::move(one_time_token)), session_(std::move(session)) {}

std::string SessionGuard::Host() const { return absl::StrCat("127.0.0.1:", port_); }

std::string SessionGuard::Address() const {
  return absl::StrCat("http://", Host(), std::string(kTokenTarget), one_time_token_);
}

// Browsers share cookies among the ports of a host, so the name includes the port.
std::string SessionGuard::SetCookie() const {
  return absl::StrCat("hullctl-view-", port_, "=", session_, "; Path=/; HttpOnly; SameSite=Strict");
}

bool SessionGuard::HasSession(std::string_view cookies) const {
  const std::string name = absl::StrCat("hullctl-view-", port_, "=");
  for (absl::string_view cookie :
       absl::StrSplit(absl::string_view(cookies.data(), cookies.size()), ';')) {
    cookie = absl::StripLeadingAsciiWhitespace(cookie);
    if (absl::ConsumePrefix(&cookie, name) && IsSame({cookie.data(), cookie.size()}, session_)) {
      return true;
    }
  }
  return false;
}

SessionGuard::Decision SessionGuard::Judge(const PageRequest& request) {
  if (request.host != Host() && request.host != absl::StrCat("localhost:", port_)) {
    return RefuseRequest(
        421, absl::StrCat("This server accepts requests only under its own name, ", Host(), "."));
  }
  const std::string own_origin = absl::StrCat("http://", std::string(request.host));
  if ((request.upgrade || !request.origin.empty()) && request.origin != own_origin) {
    return RefuseRequest(403, "Only the page opened by hullctl may connect.");
  }
  if (request.method != "GET" && request.method != "HEAD") {
    return RefuseRequest(405, "Only GET is supported.");
  }
  const bool has_session = HasSession(request.cookie);
  if (request.target.starts_with(kTokenTarget) && !request.upgrade) {
    const std::string_view token = request.target.substr(kTokenTarget.size());
    if (IsSame(token, one_time_token_) && request.method == "GET") {
      one_time_token_.clear();
      return {Verdict::kExchange, 200, ""};
    }
    // A browser with a session that opens the address again is admitted again.
    if (has_session) return {Verdict::kExchange, 200, ""};
    return RefuseRequest(403,
                         "This address was already used. Run 'hullctl view' again for a new one.");
  }
  if (!has_session) {
    return RefuseRequest(403, "Open the address printed by 'hullctl view'.");
  }
  return {Verdict::kServe, 200, ""};
}

}  // namespace hulld
