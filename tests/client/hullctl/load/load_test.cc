#include "client/hullctl/load/load.h"

#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <thread>

namespace hulld {
namespace load_test {

using std::chrono::milliseconds;

void IgnoreProgress(double /*share*/, uint64_t /*requests*/) {}

TEST(Load, SendsEachRequestOnceForAnyNumberOfClients) {
  std::mutex mutex;
  std::multiset<uint64_t> requests;
  const LoadRequest client = [&](uint64_t i) -> absl::StatusOr<uint64_t> {
    const std::lock_guard lock(mutex);
    requests.insert(i);
    return i;
  };
  LoadPlan plan;
  plan.requests = 100;
  const std::atomic<bool> stop = false;
  const LoadResult result = RunLoad(plan, {client, client, client}, stop, IgnoreProgress);
  EXPECT_EQ(requests.size(), 100U);
  EXPECT_EQ(std::set<uint64_t>(requests.begin(), requests.end()).size(), 100U);
  EXPECT_EQ(*requests.rbegin(), 99U);
  EXPECT_EQ(result.items, 99U * 100 / 2);
  EXPECT_EQ(result.latencies.count(), 100U);
  EXPECT_EQ(result.failed(), 0U);
  EXPECT_EQ(result.missed, 0U);
}

TEST(Load, FailuresAreCountedByCodeAndNotAmongLatencies) {
  const LoadRequest client = [](uint64_t i) -> absl::StatusOr<uint64_t> {
    if (i == 1) return absl::UnavailableError("first");
    if (i == 3) return absl::UnavailableError("second");
    if (i == 4) return absl::NotFoundError("gone");
    return 2;
  };
  LoadPlan plan;
  plan.requests = 6;
  const std::atomic<bool> stop = false;
  const LoadResult result = RunLoad(plan, {client}, stop, IgnoreProgress);
  EXPECT_EQ(result.latencies.count(), 3U);
  EXPECT_EQ(result.items, 6U);
  ASSERT_EQ(result.failures.size(), 2U);
  EXPECT_EQ(result.failures.at(absl::StatusCode::kUnavailable).count, 2U);
  EXPECT_EQ(result.failures.at(absl::StatusCode::kUnavailable).message, "first");
  EXPECT_EQ(result.failures.at(absl::StatusCode::kNotFound).count, 1U);
}

// Request 0 takes 100 ms; later ones are overdue long before they are sent.
TEST(Load, WithARateLatencyCountsFromWhenTheRequestWasDue) {
  const auto ask = [](std::optional<double> rate) {
    const LoadRequest client = [](uint64_t i) -> absl::StatusOr<uint64_t> {
      if (i == 0) std::this_thread::sleep_for(milliseconds(100));
      return 1;
    };
    LoadPlan plan;
    plan.requests = 20;
    plan.rate = rate;
    const std::atomic<bool> stop = false;
    return RunLoad(plan, {client}, stop, IgnoreProgress);
  };
  const LoadResult open = ask(1000);
  // Due at 9 ms, sent at 100 ms or later.
  EXPECT_GE(open.latencies.Percentile(0.5), milliseconds(80));
  EXPECT_EQ(open.latencies.count(), 20U);
}

TEST(Load, RequestsThatWereDueAndNeverSentAreCounted) {
  std::atomic<bool> stop = false;
  const LoadRequest client = [&](uint64_t /*i*/) -> absl::StatusOr<uint64_t> {
    std::this_thread::sleep_for(milliseconds(50));
    stop = true;
    return 1;
  };
  LoadPlan plan;
  plan.requests = 40;
  plan.rate = 1000;
  const LoadResult result = RunLoad(plan, {client}, stop, IgnoreProgress);
  EXPECT_EQ(result.latencies.count(), 1U);
  EXPECT_EQ(result.missed, 39U);
}

}  // namespace load_test
}  // namespace hulld
