#include "core/base/stop_poll.h"

#include <gtest/gtest.h>

#include <functional>

namespace hulld {
namespace stop_poll_test {

TEST(StopPoll, PollsAtTheFirstStepAndThenPeriodically) {
  int polls = 0;
  const std::function<bool()> should_stop = [&] {
    ++polls;
    return false;
  };
  StopPoll poll(should_stop, 4);
  EXPECT_EQ(polls, 0);
  EXPECT_FALSE(poll.Step());
  EXPECT_EQ(polls, 1);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(poll.Step());
  EXPECT_EQ(polls, 1);
  EXPECT_FALSE(poll.Step());
  EXPECT_EQ(polls, 2);
}

TEST(StopPoll, LargeStepsCountForMany) {
  int polls = 0;
  const std::function<bool()> should_stop = [&] {
    ++polls;
    return false;
  };
  StopPoll poll(should_stop, 100);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(poll.Step(50));
  EXPECT_EQ(polls, 5);
}

TEST(StopPoll, StopsPollingAfterAStop) {
  int polls = 0;
  const std::function<bool()> should_stop = [&] { return ++polls == 2; };
  StopPoll poll(should_stop, 1);
  EXPECT_FALSE(poll.Step());
  EXPECT_FALSE(poll.stopped());
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(poll.Step());
  EXPECT_TRUE(poll.stopped());
  EXPECT_TRUE(poll.Poll());
  EXPECT_EQ(polls, 2);
}

TEST(StopPoll, NeverStopsWithoutACallback) {
  const std::function<bool()> empty;
  StopPoll poll(empty, 1);
  StopPoll never;
  for (int i = 0; i < 2000; ++i) {
    EXPECT_FALSE(poll.Step());
    EXPECT_FALSE(never.Step());
  }
  EXPECT_FALSE(never.Poll());
}

}  // namespace stop_poll_test
}  // namespace hulld
