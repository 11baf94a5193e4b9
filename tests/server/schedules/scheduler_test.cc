// Small programs with and without the faults that the scheduler must find.
#include "tests/server/schedules/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/process/synchronization.h"

namespace hulld::server {
namespace scheduler_test {

using Kind = ScheduleFault::Kind;

// Returns the first fault among this many seeds.
std::optional<ScheduleFault> Find(const std::function<void()>& body, uint64_t seeds = 1000) {
  for (uint64_t seed = 1; seed <= seeds; ++seed) {
    if (auto fault = Scheduler(seed).Run(body)) return fault;
  }
  return std::nullopt;
}

void Join(std::vector<Thread>& threads) {
  for (Thread& thread : threads) thread.join();
}

TEST(Scheduler, FindsMutexesLockedInDifferentOrders) {
  const auto fault = Find([] {
    Mutex first;
    Mutex second;
    Thread other([&] {
      const std::lock_guard outer(first);
      const std::lock_guard inner(second);
    });
    {
      const std::lock_guard outer(second);
      const std::lock_guard inner(first);
    }
    other.join();
  });
  ASSERT_TRUE(fault.has_value());
  EXPECT_EQ(fault->kind, Kind::kDeadlock);
  EXPECT_NE(fault->what.find("scheduler_test.cc"), std::string::npos) << fault->what;
}

// The flag is set without the mutex, between its check and the wait.
void LoseAWakeup(bool waits_for_a_while) {
  Mutex mutex;
  ConditionVariable changed;
  bool is_set = false;
  Thread setter([&] {
    is_set = true;
    changed.notify_one();
  });
  {
    std::unique_lock lock(mutex);
    const bool is_late = is_set;
    Scheduler::Current().Note("has looked");
    if (!is_late && waits_for_a_while) changed.wait_for(lock, std::chrono::seconds(1));
    if (!is_late && !waits_for_a_while) changed.wait(lock);
  }
  setter.join();
}

TEST(Scheduler, FindsALostWakeup) {
  EXPECT_TRUE(Find([] { LoseAWakeup(false); }).has_value());
}

// The thread would continue after a second, hiding the fault.
TEST(Scheduler, FindsALostWakeupBehindATimeLimit) {
  EXPECT_TRUE(Find([] { LoseAWakeup(true); }).has_value());
}

TEST(Scheduler, DistinguishesALostWakeupFromAHang) {
  const auto forgotten = Find([] {
    Mutex mutex;
    ConditionVariable changed;
    bool is_set = false;
    Thread setter([&] {
      const std::lock_guard lock(mutex);
      is_set = true;
    });
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return is_set; });
    }
    setter.join();
  });
  ASSERT_TRUE(forgotten.has_value());
  EXPECT_EQ(forgotten->kind, Kind::kLostWakeup);
  const auto never = Find([] {
    Mutex mutex;
    ConditionVariable changed;
    std::unique_lock lock(mutex);
    changed.wait(lock, [] { return false; });
  });
  ASSERT_TRUE(never.has_value());
  EXPECT_EQ(never->kind, Kind::kDeadlock);
}

TEST(Scheduler, FindsHangs) {
  const auto fault = Find(
      [] {
        while (true) Scheduler::Current().Note("goes round");
      },
      1);
  ASSERT_TRUE(fault.has_value());
  EXPECT_EQ(fault->kind, Kind::kLivelock);
}

void Count(bool takes_mutex) {
  Mutex mutex;
  int count = 0;
  std::vector<Thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {
      std::unique_lock<Mutex> lock(mutex, std::defer_lock);
      if (takes_mutex) lock.lock();
      const int before = count;
      Scheduler::Current().Note("counts");
      count = before + 1;
    });
  }
  Join(threads);
  if (count != 3) Scheduler::Current().Fail("the count is incorrect");
}

TEST(Scheduler, FindsInterleavedSteps) {
  const auto fault = Find([] { Count(false); });
  ASSERT_TRUE(fault.has_value());
  EXPECT_EQ(fault->kind, Kind::kWrongAnswer);
}

TEST(Scheduler, FindsNothingWhereMutexesAreHeld) {
  const auto fault = Find([] { Count(true); });
  EXPECT_FALSE(fault.has_value()) << fault->what;
}

// A chain of handovers. A notification before the wait must not break any of them.
TEST(Scheduler, FindsNothingWhereConditionsAreUsedCorrectly) {
  const auto fault = Find([] {
    constexpr int kThreads = 4;
    Mutex mutex;
    ConditionVariable changed;
    int turn = 0;
    std::vector<Thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&, i] {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return turn == i; });
        ++turn;
        lock.unlock();
        changed.notify_all();
      });
    }
    Join(threads);
  });
  EXPECT_FALSE(fault.has_value()) << fault->what;
}

// The order in which three threads take a mutex: all six occur.
TEST(Scheduler, ReachesEveryOrder) {
  std::vector<std::string> orders;
  for (uint64_t seed = 1; seed <= 500; ++seed) {
    std::string order;
    const auto fault = Scheduler(seed).Run([&] {
      Mutex mutex;
      std::vector<Thread> threads;
      for (const char name : {'a', 'b', 'c'}) {
        threads.emplace_back([&, name] {
          const std::lock_guard lock(mutex);
          order += name;
        });
      }
      Join(threads);
    });
    ASSERT_FALSE(fault.has_value()) << fault->what;
    if (std::ranges::find(orders, order) == orders.end()) orders.push_back(order);
  }
  EXPECT_EQ(orders.size(), 6);
}

TEST(Scheduler, ReportsItsSteps) {
  Scheduler scheduler(1);
  ASSERT_FALSE(scheduler
                   .Run([] {
                     Mutex mutex;
                     Thread other([&] { const std::lock_guard lock(mutex); }, "helper");
                     other.join();
                   })
                   .has_value());
  const std::string steps = scheduler.Steps();
  EXPECT_NE(steps.find("thread 1 (helper) takes a mutex #1, scheduler_test.cc"), std::string::npos)
      << steps;
}

}  // namespace scheduler_test
}  // namespace hulld::server
