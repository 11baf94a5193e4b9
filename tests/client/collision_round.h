#ifndef HULLD_TESTS_CLIENT_COLLISION_ROUND_H_
#define HULLD_TESTS_CLIENT_COLLISION_ROUND_H_

#include <gtest/gtest.h>

#include "client/watch/collision_watch.h"

namespace hulld {

// Returns the messages of a watch up to the end of the round, merged. After a failure, fails the
// test and returns the messages so far.
inline v1::WatchCollisionsResponse Round(CollisionWatch& watch) {
  v1::WatchCollisionsResponse all;
  while (true) {
    const auto message = watch.Next();
    EXPECT_TRUE(message.ok()) << message.status();
    if (!message.ok()) return all;
    all.MergeFrom(*message);
    if (message->synced()) return all;
  }
}

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_COLLISION_ROUND_H_
