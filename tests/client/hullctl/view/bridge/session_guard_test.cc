#include "client/hullctl/view/bridge/session_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace hulld {
namespace session_guard_test {

using ::testing::HasSubstr;
using Verdict = SessionGuard::Verdict;

constexpr char kHost[] = "127.0.0.1:4711";
constexpr char kOrigin[] = "http://127.0.0.1:4711";
constexpr char kCookie[] = "other=1; hullctl-view-4711=session";

SessionGuard TestGuard() { return SessionGuard(4711, "token", "session"); }

PageRequest Page(std::string_view target, std::string_view cookie = "") {
  return {"GET", target, kHost, "", cookie, false};
}

PageRequest Upgrade(std::string_view origin, std::string_view cookie = kCookie) {
  return {"GET", "/page", kHost, origin, cookie, true};
}

TEST(SessionGuard, TokenIsExchangedOnceForTheCookie) {
  SessionGuard guard = TestGuard();
  EXPECT_EQ(guard.Address(), "http://127.0.0.1:4711/?token=token");
  EXPECT_EQ(guard.Judge(Page("/?token=token")).verdict, Verdict::kExchange);
  EXPECT_EQ(guard.SetCookie(), "hullctl-view-4711=session; Path=/; HttpOnly; SameSite=Strict");
  const SessionGuard::Decision again = guard.Judge(Page("/?token=token"));
  EXPECT_EQ(again.verdict, Verdict::kRefuse);
  EXPECT_EQ(again.http_status, 403);
  EXPECT_THAT(again.reason, HasSubstr("was already used"));
  // A browser with a session uses the address again, as by the back button.
  EXPECT_EQ(guard.Judge(Page("/?token=token", kCookie)).verdict, Verdict::kExchange);
}

TEST(SessionGuard, WrongTokensAreRefusedAndDoNotConsumeTheRightOne) {
  SessionGuard guard = TestGuard();
  for (const char* target : {"/?token=", "/?token=toke", "/?token=token1", "/?token=Token",
                             "/?token=session", "/?tok"}) {
    EXPECT_EQ(guard.Judge(Page(target)).verdict, Verdict::kRefuse) << target;
  }
  // A link preview must not consume it.
  PageRequest head = Page("/?token=token");
  head.method = "HEAD";
  EXPECT_EQ(guard.Judge(head).verdict, Verdict::kRefuse);
  EXPECT_EQ(guard.Judge(Page("/?token=token")).verdict, Verdict::kExchange);
  EXPECT_EQ(guard.Judge(Page("/?token=")).verdict, Verdict::kRefuse);
}

TEST(SessionGuard, NothingIsServedWithoutTheCookie) {
  SessionGuard guard = TestGuard();
  EXPECT_EQ(guard.Judge(Page("/", kCookie)).verdict, Verdict::kServe);
  EXPECT_EQ(guard.Judge(Page("/main.js", "hullctl-view-4711=session")).verdict, Verdict::kServe);
  for (const char* cookie :
       {"", "hullctl-view-4711=", "hullctl-view-4711=sessio", "hullctl-view-4711=session2",
        "hullctl-view-4712=session", "xhullctl-view-4711=session", "session"}) {
    const SessionGuard::Decision decision = guard.Judge(Page("/", cookie));
    EXPECT_EQ(decision.verdict, Verdict::kRefuse) << cookie;
    EXPECT_EQ(decision.http_status, 403) << cookie;
  }
}

// An attacker's name that resolves to 127.0.0.1 arrives as Host.
TEST(SessionGuard, HostMustBeThisAddress) {
  SessionGuard guard = TestGuard();
  for (const char* host : {"", "127.0.0.1", "localhost", "127.0.0.1:4712", "evil.example:4711",
                           "127.0.0.1:4711.evil.example", "127.0.0.1:47110", "[::1]:4711"}) {
    PageRequest request = Page("/", kCookie);
    request.host = host;
    EXPECT_EQ(guard.Judge(request).http_status, 421) << host;
  }
  PageRequest request = Page("/", kCookie);
  request.host = "localhost:4711";
  EXPECT_EQ(guard.Judge(request).verdict, Verdict::kServe);
}

TEST(SessionGuard, WebSocketNeedsTheOriginOfThePage) {
  SessionGuard guard = TestGuard();
  EXPECT_EQ(guard.Judge(Upgrade(kOrigin)).verdict, Verdict::kServe);
  for (const char* origin :
       {"", "null", "http://evil.example", "https://127.0.0.1:4711", "http://127.0.0.1:4712",
        "http://localhost:4711", "http://127.0.0.1:4711/"}) {
    EXPECT_EQ(guard.Judge(Upgrade(origin)).http_status, 403) << origin;
  }
  EXPECT_EQ(guard.Judge(Upgrade(kOrigin, "")).http_status, 403);
  // Another site cannot read a file with the user's cookie either.
  PageRequest foreign = Page("/", kCookie);
  foreign.origin = "http://evil.example";
  EXPECT_EQ(guard.Judge(foreign).http_status, 403);
}

TEST(SessionGuard, OnlyReadsAreAnswered) {
  SessionGuard guard = TestGuard();
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "CONNECT"}) {
    PageRequest request = Page("/", kCookie);
    request.method = method;
    EXPECT_EQ(guard.Judge(request).http_status, 405) << method;
  }
}

TEST(SessionGuard, SecretsAreNewEachTime) {
  auto a = SessionGuard::Create(1);
  auto b = SessionGuard::Create(1);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_NE(a->Address(), b->Address());
  EXPECT_NE(a->SetCookie(), b->SetCookie());
  // 32 bytes as hexadecimal digits.
  EXPECT_EQ(a->Address().size(), std::string("http://127.0.0.1:1/?token=").size() + 64);
}

}  // namespace session_guard_test
}  // namespace hulld
