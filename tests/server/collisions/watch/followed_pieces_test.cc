#include "server/collisions/watch/followed_pieces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hulld::server {
namespace followed_pieces_test {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Ids = std::vector<std::string>;

TEST(FollowedPieces, ComeAndGoWithTheLastBodyThatHasThem) {
  FollowedPieces pieces;
  FollowedPieces::Difference difference;
  pieces.Set(0, Ids{"a", "b"}, &difference);
  pieces.Set(1, Ids{"b"}, &difference);
  EXPECT_THAT(difference.added, ElementsAre("a", "b"));
  EXPECT_THAT(difference.dropped, IsEmpty());
  difference = {};
  pieces.Set(0, Ids{}, &difference);
  EXPECT_THAT(difference.dropped, ElementsAre("a"));
  EXPECT_THAT(pieces.BodiesOf("b"), ElementsAre(1));
}

// In one round, for either order of the bodies.
TEST(FollowedPieces, WhatOneBodyGivesToAnotherIsFollowedAllTheWhile) {
  for (const bool giver_first : {true, false}) {
    FollowedPieces pieces;
    FollowedPieces::Difference difference;
    const size_t giver = giver_first ? 0 : 1;
    const size_t taker = 1 - giver;
    pieces.Set(giver, Ids{"x"}, &difference);
    pieces.Set(taker, Ids{"z"}, &difference);
    difference = {};
    for (const size_t body : {size_t{0}, size_t{1}}) {
      pieces.Set(body, body == giver ? Ids{"y"} : Ids{"x"}, &difference);
    }
    difference.Settle();
    EXPECT_THAT(difference.added, ElementsAre("y")) << giver_first;
    EXPECT_THAT(difference.dropped, ElementsAre("z")) << giver_first;
    EXPECT_THAT(pieces.BodiesOf("x"), ElementsAre(taker));
  }
}

}  // namespace followed_pieces_test
}  // namespace hulld::server
