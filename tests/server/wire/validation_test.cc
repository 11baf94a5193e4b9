// Requests refused before they reach a hull: addresses, IDs, page tokens; and the contents of the
// log.

#include <absl/status/status.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "server/access/caller.h"
#include "server/contract/errors.h"
#include "server/process/listen_address.h"
#include "server/process/log.h"
#include "server/store/memory_store.h"
#include "server/wire/decode.h"
#include "server/wire/unary_answers.h"

namespace hulld::server {
namespace validation_test {

using ::testing::HasSubstr;

TEST(HullId, SegmentsJoinedBySlashesAreAccepted) {
  for (const char* id : {"a", "A9", "arm/3", "a.b_c-d/0", "1/2/3"}) {
    EXPECT_TRUE(CheckHullIdSyntax(id, "hull_id").ok()) << id;
  }
  EXPECT_TRUE(CheckHullIdSyntax(std::string(256, 'a'), "hull_id").ok());
}

TEST(HullId, AnythingElseIsRefusedWithItsPosition) {
  const auto expect = [](const std::string& id, const std::string& what) {
    const absl::Status status = CheckHullIdSyntax(id, "field");
    ASSERT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << id;
    EXPECT_THAT(std::string(status.message()), HasSubstr(what));
  };
  expect("", "field is empty");
  expect("/a", "empty segment at character 0");
  expect("a/", "empty segment at character 2");
  expect("a//b", "empty segment at character 2");
  expect(".a", "malformed at character 0");
  expect("a/-b", "malformed at character 2");
  expect("a\nb", "\"a\\nb\" is malformed at character 1");
  expect("\xC3\xA4", "\"\xC3\xA4\" is malformed at character 0");
  expect(std::string("a\0b", 3), "malformed at character 1");
  expect(std::string(257, 'a'), "has 257 characters; the limit is 256");
}

TEST(FreshnessWords, ConditionsAreForwarded) {
  using std::chrono::nanoseconds;
  const MemoryStore store;
  const auto began = SteadyClock::now();
  v1::Freshness message;
  auto freshness = DecodeFreshness(message, store, began);
  ASSERT_TRUE(freshness.ok());
  EXPECT_EQ(freshness->max_staleness, nanoseconds(0));
  EXPECT_EQ(freshness->at_least_revision, 0);
  EXPECT_EQ(freshness->began, began);
  message.mutable_max_staleness()->set_seconds(2);
  message.mutable_max_staleness()->set_nanos(5);
  freshness = DecodeFreshness(message, store, began);
  EXPECT_EQ(freshness->max_staleness, nanoseconds(2'000'000'005));
  message.set_at_least_revision(7);
  message.set_store_id(store.id());
  freshness = DecodeFreshness(message, store, began);
  EXPECT_EQ(freshness->max_staleness, nanoseconds(2'000'000'005));
  EXPECT_EQ(freshness->at_least_revision, 7);
  // A revision alone accepts any age.
  message.clear_max_staleness();
  freshness = DecodeFreshness(message, store, began);
  EXPECT_EQ(freshness->max_staleness, std::nullopt);
  // The maximum representable duration does not overflow.
  message.mutable_max_staleness()->set_seconds(315'576'000'000);
  freshness = DecodeFreshness(message, store, began);
  EXPECT_GT(freshness->max_staleness, nanoseconds(std::chrono::hours(24 * 365)));
}

TEST(FreshnessWords, MalformedTextAndOtherStoresAreRefused) {
  const MemoryStore store;
  const auto expect = [&store](const v1::Freshness& message, absl::StatusCode code,
                               const std::string& what) {
    const absl::Status status = DecodeFreshness(message, store, SteadyClock::now()).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(what));
  };
  for (const auto& [seconds, nanos] :
       {std::pair<int64_t, int32_t>{-1, 0}, {0, -1}, {0, 1'000'000'000}}) {
    v1::Freshness message;
    message.mutable_max_staleness()->set_seconds(seconds);
    message.mutable_max_staleness()->set_nanos(nanos);
    expect(message, absl::StatusCode::kInvalidArgument, "freshness.max_staleness is");
  }
  v1::Freshness message;
  message.set_at_least_revision(1);
  expect(message, absl::StatusCode::kInvalidArgument, "requires store_id");
  message.set_store_id("another");
  expect(message, absl::StatusCode::kFailedPrecondition, store.id());
}

TEST(ListenAddress, LoopbackAndUnixSocketsAreLocal) {
  for (const char* text : {"127.0.0.1:50551", "127.8.9.10:1", "[::1]:0", "localhost:80",
                           "unix:/run/hulld.sock", "unix:relative", "unix:///run/hulld.sock"}) {
    const absl::StatusOr<ListenAddress> address = ParseListenAddress(text);
    ASSERT_TRUE(address.ok()) << text;
    EXPECT_TRUE(address->is_local()) << text;
    EXPECT_TRUE(CheckExposure(*address, false, false).ok()) << text;
  }
}

TEST(ListenAddress, OtherAddressesNeedInsecure) {
  for (const char* text : {"0.0.0.0:50551", "[::]:50551", "192.168.1.7:1", "example.com:1",
                           "[::ffff:127.0.0.1]:1", "1270.0.0.1:1", "localhost.example.com:1"}) {
    const absl::StatusOr<ListenAddress> address = ParseListenAddress(text);
    ASSERT_TRUE(address.ok()) << text;
    const absl::Status refused = CheckExposure(*address, false, false);
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("--insecure"));
    EXPECT_TRUE(CheckExposure(*address, false, true).ok());
  }
}

TEST(ListenAddress, MalformedAddressesNameTheFlag) {
  for (const char* text : {"", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536", ":1",
                           "::1:50551", "unix:", "127.0.0.1:+1"}) {
    const absl::Status status = ParseListenAddress(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--listen")) << text;
  }
}

TEST(PageToken, RoundTripsForItsCallAndPrefixOnly) {
  constexpr Rpc kCall = Rpc::kListHulls;
  const std::string token = EncodePageToken(kCall, "a/", "a/7");
  EXPECT_EQ(*DecodePageToken(kCall, token, "a/"), "a/7");
  EXPECT_EQ(*DecodePageToken(kCall, "", "a/"), "");
  for (const std::string& bad :
       {token.substr(1), std::string("%%"), std::string("YQ"), EncodePageToken(kCall, "a/", "b"),
        EncodePageToken(kCall, "a/", "a/ "), EncodePageToken(kCall, "b", "b"),
        EncodePageToken(Rpc::kListBodies, "a/", "a/7")}) {
    EXPECT_EQ(DecodePageToken(kCall, bad, "a/").status().code(), absl::StatusCode::kInvalidArgument)
        << bad;
  }
}

TEST(StatusMap, KeepsCodeAndMessage) {
  for (int code = 1; code <= 16; ++code) {
    const absl::Status status(static_cast<absl::StatusCode>(code), "why");
    EXPECT_EQ(static_cast<int>(ToGrpc(status).error_code()), code);
    EXPECT_EQ(ToGrpc(status).error_message(), "why");
  }
  EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok());
}

TEST(Log, JsonStringsAreEscaped) {
  EXPECT_EQ(JsonEscape("plain"), "plain");
  EXPECT_EQ(JsonEscape("a\"b\\c\n\t\x01\x7F"), "a\\\"b\\\\c\\u000a\\u0009\\u0001\\u007f");
  EXPECT_EQ(JsonEscape("\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80"),
            "\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80");
}

TEST(Log, InvalidUtf8IsReplaced) {
  EXPECT_EQ(JsonEscape("\xFF"), "\\ufffd");
  EXPECT_EQ(JsonEscape("\xC3"), "\\ufffd");
  EXPECT_EQ(JsonEscape("\xC0\x80"), "\\ufffd\\ufffd");
  EXPECT_EQ(JsonEscape("\xED\xA0\x80"), "\\ufffd\\ufffd\\ufffd");
  EXPECT_EQ(JsonEscape("\xF4\x90\x80\x80x"), "\\ufffd\\ufffd\\ufffd\\ufffdx");
}

}  // namespace validation_test
}  // namespace hulld::server
