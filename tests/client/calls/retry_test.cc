#include "client/calls/retry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace hulld {
namespace retry_test {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;

// A policy that records its waits instead of waiting.
RetryPolicy Recording(std::vector<milliseconds>* waits, int max_attempts) {
  RetryPolicy policy;
  policy.max_attempts = max_attempts;
  policy.wait = [waits](milliseconds wait) { waits->push_back(wait); };
  return policy;
}

Deadline Far() { return std::chrono::steady_clock::now() + std::chrono::hours(1); }

TEST(Retry, UnavailableIsRetriedWithDoublingWaitsUpToACap) {
  std::vector<milliseconds> waits;
  int attempts = 0;
  const absl::Status status = CallWithRetries(Recording(&waits, 8), Far(), [&] {
    ++attempts;
    return absl::UnavailableError("down");
  });
  EXPECT_EQ(status, absl::UnavailableError("down"));
  EXPECT_EQ(attempts, 8);
  EXPECT_THAT(
      waits, ElementsAre(milliseconds(100), milliseconds(200), milliseconds(400), milliseconds(800),
                         milliseconds(1600), milliseconds(2000), milliseconds(2000)));
}

TEST(Retry, OnlyTheDeadlineBoundsAttemptsByDefault) {
  Deadline now;
  RetryPolicy policy;
  policy.now = [&now] { return now; };
  policy.wait = [&now](milliseconds wait) { now += wait; };
  int attempts = 0;
  const absl::Status status = CallWithRetries(policy, now + std::chrono::minutes(1), [&] {
    return ++attempts < 30 ? absl::UnavailableError("down") : absl::OkStatus();
  });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(attempts, 30);
}

TEST(Retry, EndsWithTheFirstOtherAnswer) {
  std::vector<milliseconds> waits;
  int attempts = 0;
  EXPECT_TRUE(CallWithRetries(Recording(&waits, 4), Far(), [&] {
                return ++attempts < 3 ? absl::UnavailableError("") : absl::OkStatus();
              }).ok());
  EXPECT_EQ(attempts, 3);
}

TEST(Retry, OtherErrorsAreNotRetried) {
  for (const absl::StatusCode code :
       {absl::StatusCode::kDeadlineExceeded, absl::StatusCode::kInternal,
        absl::StatusCode::kResourceExhausted, absl::StatusCode::kNotFound,
        absl::StatusCode::kAborted, absl::StatusCode::kCancelled, absl::StatusCode::kUnknown}) {
    std::vector<milliseconds> waits;
    int attempts = 0;
    EXPECT_EQ(CallWithRetries(Recording(&waits, 4), Far(),
                              [&] {
                                ++attempts;
                                return absl::Status(code, "x");
                              })
                  .code(),
              code);
    EXPECT_EQ(attempts, 1);
    EXPECT_THAT(waits, IsEmpty());
  }
}

TEST(Retry, AWaitBeyondTheDeadlineIsNotStarted) {
  std::vector<milliseconds> waits;
  int attempts = 0;
  const Deadline past = std::chrono::steady_clock::now();
  EXPECT_TRUE(absl::IsUnavailable(CallWithRetries(Recording(&waits, 4), past, [&] {
    ++attempts;
    return absl::UnavailableError("");
  })));
  EXPECT_EQ(attempts, 1);
  EXPECT_THAT(waits, IsEmpty());
}

TEST(Retry, UsesTheInjectedClock) {
  Deadline now;
  std::vector<milliseconds> waits;
  RetryPolicy policy = Recording(&waits, 100);
  policy.now = [&now] { return now; };
  policy.wait = [&](milliseconds wait) {
    waits.push_back(wait);
    now += wait;
  };
  const Deadline deadline = now + milliseconds(800);
  EXPECT_TRUE(absl::IsUnavailable(
      CallWithRetries(policy, deadline, [] { return absl::UnavailableError(""); })));
  // The third would end at or after the deadline of 700 ms.
  EXPECT_THAT(waits, ElementsAre(milliseconds(100), milliseconds(200), milliseconds(400)));
  // Call deadlines use the wall clock, as gRPC requires: they denote the same time.
  const auto before = std::chrono::system_clock::now();
  const auto moment = policy.ForCall(now + std::chrono::hours(1)) - std::chrono::hours(1);
  const auto after = std::chrono::system_clock::now();
  EXPECT_TRUE(before <= moment && moment <= after);
}

TEST(Retry, ADelayFromTheServerIsAMinimum) {
  absl::Status full = absl::ResourceExhaustedError("full");
  full.SetPayload("grpc-retry-pushback-ms", absl::Cord("1500"));
  std::vector<milliseconds> waits;
  EXPECT_EQ(CallWithRetries(Recording(&waits, 3), Far(), [&] { return full; }), full);
  EXPECT_THAT(waits, ElementsAre(milliseconds(1500), milliseconds(1500)));
  for (const char* no_hint : {"-1", "soon"}) {
    full.SetPayload("grpc-retry-pushback-ms", absl::Cord(no_hint));
    EXPECT_FALSE(MayRetry(full));
  }
}

TEST(Retry, OneAttemptMeansNoRetries) {
  std::vector<milliseconds> waits;
  EXPECT_FALSE(WaitBeforeRetry(Recording(&waits, 1), 1, Far()));
  EXPECT_THAT(waits, IsEmpty());
}

}  // namespace retry_test
}  // namespace hulld
