#ifndef HULLD_TESTS_CLIENT_COLLISION_ROUND_H_
#define HULLD_TESTS_CLIENT_COLLISION_ROUND_H_

#include <gtest/gtest.h>

#include "client/watch/collision_watch.h"

namespace hulld {

// The messages of a watch up to the next that ends a round, as one; what there was before a
// failure, which fails the test.
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
