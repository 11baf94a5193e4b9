#include "server/process/task_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/process/parallel_loop.h"

namespace hulld::server {
namespace task_pool_test {

using ::testing::ElementsAre;

// Records the names of tasks in the order in which they run.
class Order {
 public:
  std::function<void()> Task(const std::string& name) {
    return [this, name] {
      const std::lock_guard lock(mutex_);
      names_.push_back(name);
    };
  }
  // Requires: the pool is destroyed.
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::mutex mutex_;
  std::vector<std::string> names_;
};

// A pool with one thread, blocked until Release.
class HeldPool {
 public:
  HeldPool()
      : pool_(std::make_unique<TaskPool>(1)), lane_(std::make_unique<TaskPool::Lane>(*pool_)) {
    std::promise<void> held;
    lane_->Submit([this, &held] {
      held.set_value();
      released_.get_future().wait();
    });
    held.get_future().wait();
  }

  TaskPool& pool() { return *pool_; }
  void Release() { released_.set_value(); }
  // Runs the queued tasks.
  void End() { pool_.reset(); }

 private:
  std::promise<void> released_;
  std::unique_ptr<TaskPool> pool_;
  std::unique_ptr<TaskPool::Lane> lane_;
};

TEST(TaskPool, SingleCallsOvertakeQueuedSlices) {
  HeldPool held;
  Order order;
  TaskPool::Lane batch(held.pool());
  batch.Submit(order.Task("slice 1"));
  batch.Submit(order.Task("slice 2"));
  held.pool().Submit(order.Task("single 1"));
  held.pool().Submit(order.Task("single 2"));
  EXPECT_EQ(held.pool().waiting(), 2u);
  held.Release();
  held.End();
  EXPECT_THAT(order.names(), ElementsAre("single 1", "single 2", "slice 1", "slice 2"));
}

TEST(TaskPool, ASingleCallWaitsForAtMostOneSlice) {
  HeldPool held;
  Order order;
  TaskPool& pool = held.pool();
  TaskPool::Lane batch(pool);
  batch.Submit([&] {
    order.Task("slice 1")();
    pool.Submit(order.Task("single"));
    batch.Submit(order.Task("slice 3"));
  });
  batch.Submit(order.Task("slice 2"));
  held.Release();
  held.End();
  EXPECT_THAT(order.names(), ElementsAre("slice 1", "single", "slice 2", "slice 3"));
}

TEST(TaskPool, LanesTakeTurnsRegardlessOfLength) {
  HeldPool held;
  Order order;
  TaskPool::Lane a(held.pool());
  TaskPool::Lane b(held.pool());
  for (const char* name : {"a1", "a2", "a3", "a4"}) a.Submit(order.Task(name));
  for (const char* name : {"b1", "b2"}) b.Submit(order.Task(name));
  held.Release();
  held.End();
  EXPECT_THAT(order.names(), ElementsAre("a1", "b1", "a2", "b2", "a3", "a4"));
}

TEST(TaskPool, ConnectionsOfAClientTakeTurns) {
  HeldPool held;
  Order order;
  for (const char* name : {"a1", "a2", "a3"}) held.pool().Submit(order.Task(name), {1, 10});
  held.pool().Submit(order.Task("A1"), {1, 11});
  // Another client gets a turn for each turn of all connections of the first one.
  for (const char* name : {"b1", "b2", "b3"}) held.pool().Submit(order.Task(name), {2, 12});
  held.Release();
  held.End();
  EXPECT_THAT(order.names(), ElementsAre("a1", "b1", "A1", "b2", "a2", "b3", "a3"));
}

TEST(TaskPool, ClientsTakeTurnsRegardlessOfTheirLoad) {
  HeldPool held;
  Order order;
  for (const char* name : {"a1", "a2", "a3"}) held.pool().Submit(order.Task(name), {1});
  held.pool().Submit(order.Task("b1"), {2});
  // Two long calls of one client share the turns of a client.
  TaskPool::Lane a(held.pool());
  TaskPool::Lane also_a(held.pool());
  TaskPool::Lane b(held.pool());
  for (const char* name : {"slice a1", "slice a2"}) a.Submit(order.Task(name), {1});
  for (const char* name : {"slice A1", "slice A2"}) also_a.Submit(order.Task(name), {1});
  for (const char* name : {"slice b1", "slice b2"}) b.Submit(order.Task(name), {2});
  held.Release();
  held.End();
  EXPECT_THAT(order.names(), ElementsAre("a1", "b1", "a2", "a3", "slice a1", "slice b1", "slice A1",
                                         "slice b2", "slice a2", "slice A2"));
}

TEST(TaskPool, SingleCallsOfClientsTakeTurns) {
  Order order;
  {
    std::promise<void> released;
    TaskPool pool(1);
    std::promise<void> held;
    pool.Submit([&] {
      held.set_value();
      released.get_future().wait();
    });
    held.get_future().wait();
    for (const char* name : {"a1", "a2", "a3"}) pool.Submit(order.Task(name), {1});
    for (const char* name : {"b1", "b2"}) pool.Submit(order.Task(name), {2});
    EXPECT_EQ(pool.waiting(), 5u);
    released.set_value();
  }
  EXPECT_THAT(order.names(), ElementsAre("a1", "b1", "a2", "b2", "a3"));
}

TEST(TaskPool, SlicesOfOneLaneRunOnAllThreads) {
  // Declared before the pool: a task may access them until it ends.
  std::promise<void> first;
  std::promise<void> second;
  std::promise<void> done;
  TaskPool pool(2);
  TaskPool::Lane lane(pool);
  // Both tasks wait for each other.
  lane.Submit([&] {
    first.set_value();
    second.get_future().wait();
  });
  lane.Submit([&] {
    first.get_future().wait();
    second.set_value();
    done.set_value();
  });
  done.get_future().wait();
}

TEST(TaskPool, SlicesWaitOnlyWhileSingleCallsArrive) {
  std::promise<void> both;
  std::atomic<int> running = 0;
  TaskPool pool(2);
  TaskPool::Lane lane(pool);
  pool.NoteSingleCall();
  const std::shared_future<void> ready = both.get_future();
  for (int i = 0; i < 2; ++i) {
    lane.Submit([&, ready] {
      if (++running == 2) both.set_value();
      ready.wait();
    });
  }
  ready.wait();
}

TEST(TaskPool, DestructionRunsQueuedTasks) {
  std::atomic<int> ran = 0;
  {
    auto pool = std::make_unique<TaskPool>(2);
    TaskPool::Lane lane(*pool);
    for (int i = 0; i < 100; ++i) {
      lane.Submit([&] { ++ran; });
      pool->Submit([&] { ++ran; });
    }
    pool.reset();
  }
  EXPECT_EQ(ran, 200);
}

TEST(TaskPool, TasksOfLastActionsRun) {
  std::promise<int> ended;
  std::function<void(int)> run;
  TaskPool pool(2);
  run = [&](int i) {
    if (i == 1000) return ended.set_value(i);
    pool.Submit([&run, i] { run(i + 1); }, kNoClient, true);
  };
  pool.Submit([&] { run(0); });
  EXPECT_EQ(ended.get_future().get(), 1000);
}

TEST(TaskPool, TasksOfLastActionsFollowQueuedTasks) {
  HeldPool held;
  Order order;
  TaskPool& pool = held.pool();
  pool.Submit([&] {
    order.Task("first")();
    pool.Submit(order.Task("last"), kNoClient, true);
  });
  pool.Submit(order.Task("second"));
  held.Release();
  held.End();
  EXPECT_THAT(order.names(), ElementsAre("first", "second", "last"));
}

TEST(ParallelLoop, RunsEachOnce) {
  TaskPool helpers(3);
  for (const size_t count : {0, 1, 7, 8, 9, 1000}) {
    std::vector<std::atomic<int>> runs(count);
    ParallelLoop::Run(helpers, 3, count, 8, [&](size_t begin, size_t end) {
      EXPECT_LE(end - begin, 8u);
      for (size_t i = begin; i < end; ++i) ++runs[i];
    });
    for (const std::atomic<int>& times : runs) EXPECT_EQ(times, 1);
  }
}

TEST(ParallelLoop, DoesNotWaitForBusyThreads) {
  TaskPool helpers(1);
  std::promise<void> free;
  helpers.Submit([ready = free.get_future().share()] { ready.wait(); });
  int runs = 0;
  ParallelLoop::Run(helpers, 1, 100, 10, [&](size_t, size_t) { ++runs; });
  EXPECT_EQ(runs, 10);
  free.set_value();
}

TEST(ParallelLoop, WaitsForWorkStartedByAnotherThread) {
  TaskPool helpers(1);
  std::promise<void> both;
  std::atomic<int> running = 0;
  std::atomic<int> ended = 0;
  const std::shared_future<void> ready = both.get_future().share();
  ParallelLoop::Run(helpers, 1, 2, 1, [&, ready](size_t, size_t) {
    if (++running == 2) both.set_value();
    ready.wait();
    ++ended;
  });
  EXPECT_EQ(ended, 2);
}

}  // namespace task_pool_test
}  // namespace hulld::server
