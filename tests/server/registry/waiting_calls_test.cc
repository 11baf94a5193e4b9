#include "server/registry/waiting_calls.h"

#include <absl/status/status.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <thread>

#include "server/contract/stopped_call.h"

namespace hulld::server {
namespace waiting_calls_test {

TEST(WaitingCalls, EachCallIsNotifiedOnce) {
  WaitingCalls calls;
  int notified = 0;
  const auto wait = calls.Add({}, [&](const absl::Status& status) {
    EXPECT_TRUE(absl::IsUnavailable(status));
    ++notified;
  });
  EXPECT_EQ(calls.count(), 1);
  wait->Finish(absl::UnavailableError("no database"));
  EXPECT_EQ(calls.count(), 0);
  wait->Finish(absl::OkStatus());
  EXPECT_EQ(notified, 1);
}

// Also the last one in the queue.
TEST(WaitingCalls, ACancelledCallEndsAndOtherCallsWait) {
  WaitingCalls calls;
  std::atomic<bool> is_cancelled = false;
  std::promise<absl::Status> notified;
  bool is_other_notified = false;
  const auto other =
      calls.Add([] { return false; }, [&](const absl::Status&) { is_other_notified = true; });
  const auto wait = calls.Add([&] { return is_cancelled.load(); },
                              [&](const absl::Status& status) { notified.set_value(status); });
  is_cancelled = true;
  EXPECT_TRUE(absl::IsCancelled(notified.get_future().get()));
  EXPECT_EQ(calls.count(), 1);
  wait->Finish(absl::OkStatus());
  EXPECT_FALSE(is_other_notified);
  other->Finish(absl::OkStatus());
  EXPECT_TRUE(is_other_notified);
}

// The state of a call's stop predicate is gone as soon as the call ends, on any thread.
TEST(WaitingCalls, FinishedCallsAreNotPolled) {
  WaitingCalls calls;
  constexpr int kCalls = 2000;
  std::atomic<int> notified = 0;
  for (int i = 0; i < kCalls; ++i) {
    auto alive = std::make_shared<std::atomic<bool>>(true);
    const auto wait = calls.Add(
        [alive] {
          EXPECT_TRUE(alive->load());
          return true;
        },
        [alive, &notified](const absl::Status&) {
          alive->store(false);
          ++notified;
        });
    if (i % 100 == 0) std::this_thread::sleep_for(kStopPoll / 2);
    wait->Finish(absl::OkStatus());
  }
  // None is notified twice; the notification of a call that the other thread ends may arrive
  // slightly later.
  while (calls.count() > 0 || notified < kCalls) std::this_thread::yield();
  EXPECT_EQ(notified, kCalls);
}

}  // namespace waiting_calls_test
}  // namespace hulld::server
