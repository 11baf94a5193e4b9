#include "client/hullctl/view/answer_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hulld {
namespace answer_feed_test {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(AnswerFeed, AMotionIsAskedFromStartToEndAtAnyTime) {
  ViewObject wall{"wall", "cube", -1, {1, 0, 0, 0, 9, 0, 0}, 0.5};
  ViewObject ball{"ball", "cube"};
  ball.motion = {{1, 0, 0, 0, 3, 0, 0}, {0, 1, 0, 0, 1, 0, 0}};
  EXPECT_FALSE(MotionRequest(wall, wall).has_value());
  for (const double time : {0.0, 0.25}) {
    ball.pose = PoseAt(*ball.motion, time);
    const auto request = MotionRequest(wall, ball);
    ASSERT_TRUE(request.has_value());
    EXPECT_FALSE(request->a().has_end_pose());
    EXPECT_EQ(request->a().pose().translation().x(), 9);
    EXPECT_EQ(request->a().radius(), 0.5);
    EXPECT_EQ(request->b().pose().translation().x(), 3);
    EXPECT_EQ(request->b().pose().rotation().w(), 1);
    EXPECT_EQ(request->b().end_pose().translation().x(), 1);
    EXPECT_EQ(request->b().end_pose().rotation().x(), 1);
  }
  ball.hull_id.clear();
  EXPECT_FALSE(MotionRequest(wall, ball).has_value());
}

TEST(AnswerFeed, TheFirstContactOfAMotionMayBeAbsent) {
  v1::CheckCollisionResponse response;
  response.set_relation(v1::RELATION_SEPARATED);
  response.mutable_first_contact()->set_separated_until(1);
  EXPECT_THAT(MotionAnswerJson({0, 1}, 7, response), Not(HasSubstr("contactTime")));
  response.set_relation(v1::RELATION_TOUCHING);
  response.mutable_first_contact()->set_separated_until(0);
  response.mutable_first_contact()->set_contact_time(0);
  EXPECT_EQ(MotionAnswerJson({0, 1}, 7, response),
            R"({"type":"motion","update":7,"pair":[0,1],"relation":"RELATION_TOUCHING",)"
            R"("firstContact":{"separatedUntil":0,"intervals":[],"contactTime":0}})");
  EXPECT_EQ(MotionAnswerJson({0, 1}, 7, absl::NotFoundError("hull \"a\" not found")),
            R"({"type":"motion","update":7,"pair":[0,1],"problem":"hull \"a\" not found"})");
}

}  // namespace answer_feed_test
}  // namespace hulld
