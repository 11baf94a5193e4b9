#ifndef HULLD_TESTS_SERVER_COLLISIONS_WATCH_ROUND_H_
#define HULLD_TESTS_SERVER_COLLISIONS_WATCH_ROUND_H_

#include <gtest/gtest.h>

#include "client/watch/collision_watch.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Reads messages of a watch up to the next `synced`, and merges them.
inline v1::WatchCollisionsResponse ReadRound(CollisionWatch& watch) {
  v1::WatchCollisionsResponse all;
  while (!all.synced()) {
    const auto message = watch.Next();
    EXPECT_TRUE(message.ok()) << message.status();
    if (!message.ok()) break;
    all.MergeFrom(*message);
  }
  return all;
}

}  // namespace hulld

#endif  // HULLD_TESTS_SERVER_COLLISIONS_WATCH_ROUND_H_
