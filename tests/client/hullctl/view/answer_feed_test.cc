#include "client/hullctl/view/answer_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "client/hullctl/view/bridge/bridge.h"
#include "tests/client/fake_hulld.h"

namespace hulld {
namespace answer_feed_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Records the answers about the pair.
class RecordingPage : public PageChannel {
 public:
  bool SendText(std::string json) override {
    const std::lock_guard lock(mutex_);
    if (json.find(R"("type":"answer")") != std::string::npos) answers_.push_back(std::move(json));
    changed_.notify_all();
    return true;
  }
  bool SendBinary(std::string) override { return true; }

  // Waits for this many answers and returns all.
  std::vector<std::string> Wait(size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return answers_.size() >= count; });
    return answers_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> answers_;
};

// The page has the error until another one, or an answer, replaces it.
TEST(AnswerFeed, AnUnreachableServerIsReportedOnceAndAskedAgain) {
  FakeHulld hulld;
  const grpc::Status unreachable(grpc::StatusCode::UNAVAILABLE, "unreachable");
  hulld.FailNext("CheckCollision", {unreachable, unreachable,
                                    grpc::Status(grpc::StatusCode::PERMISSION_DENIED, "revoked")});
  ClientOptions options;
  options.server = hulld.address();
  options.retry.max_attempts = 1;
  const Client client(options);
  const auto page = std::make_shared<RecordingPage>();
  AnswerFeed feed(client, page);
  ViewScene scene;
  scene.objects = {{"a", "a"}, {"b", "b"}};
  feed.Show(scene, 1);
  ViewQuery query;
  query.scene = 1;
  query.pair = {0, 1};
  query.rest = true;
  feed.Request(query);
  EXPECT_THAT(page->Wait(2), ElementsAre(HasSubstr("unreachable"), HasSubstr("revoked")));
  EXPECT_EQ(hulld.calls("CheckCollision"), 3);
}

TEST(AnswerFeed, AMotionIsQueriedFromStartToEndAtAnyTime) {
  ViewObject wall{"wall", "cube", -1, {1, 0, 0, 0, 9, 0, 0}, 0.5};
  ViewObject ball{"ball", "cube"};
  ball.motion = {{1, 0, 0, 0, 3, 0, 0}, {0, 1, 0, 0, 1, 0, 0}};
  EXPECT_FALSE(MotionRequest(wall, wall, true).has_value());
  for (const double time : {0.0, 0.25}) {
    ball.pose = PoseAt(*ball.motion, time);
    const auto request = MotionRequest(wall, ball, time > 0);
    ASSERT_TRUE(request.has_value());
    EXPECT_EQ(request->wanted().certificate(), time > 0);
    EXPECT_FALSE(request->a().has_end_pose());
    EXPECT_EQ(request->a().pose().translation().x(), 9);
    EXPECT_EQ(request->a().radius(), 0.5);
    EXPECT_EQ(request->b().pose().translation().x(), 3);
    EXPECT_EQ(request->b().pose().rotation().w(), 1);
    EXPECT_EQ(request->b().end_pose().translation().x(), 1);
    EXPECT_EQ(request->b().end_pose().rotation().x(), 1);
  }
  ball.hull_id.clear();
  EXPECT_FALSE(MotionRequest(wall, ball, true).has_value());
}

TEST(AnswerFeed, TheFirstContactOfAMotionMayBeAbsent) {
  const ViewObject wall{"wall", "cube"};
  ViewObject ball{"ball", "", -1, {1, 0, 0, 0, 2, 0, 0}};
  ball.motion = {{1, 0, 0, 0, 3, 0, 0}, {0, 1, 0, 0, 1, 0, 0}};
  const auto message = [&](const absl::StatusOr<v1::CheckCollisionResponse>& response) {
    return MotionAnswerJson({{0, 1}, wall, ball, 7}, response);
  };
  v1::CheckCollisionResponse response;
  response.mutable_hull_a()->set_hull_id("cube");
  response.mutable_hull_a()->set_revision(2);
  response.set_relation(v1::RELATION_SEPARATED);
  response.mutable_first_contact()->set_separated_until(1);
  EXPECT_THAT(message(response), Not(HasSubstr("contactTime")));
  response.set_relation(v1::RELATION_TOUCHING);
  response.mutable_first_contact()->set_separated_until(0);
  response.mutable_first_contact()->set_contact_time(0);
  EXPECT_EQ(message(response),
            R"({"type":"motion","update":7,"pair":[0,1],"poses":[1,0,0,0,0,0,0,1,0,0,0,3,0,0],)"
            R"("hulls":[{"hullId":"cube","createRevision":"0","revision":"2","storeId":""}],)"
            R"("relation":"RELATION_TOUCHING",)"
            R"("firstContact":{"separatedUntil":0,"intervals":[],"contactTime":0},)"
            R"("pieceCertificates":[]})");
  EXPECT_EQ(message(absl::NotFoundError("hull \"a\" not found")),
            R"({"type":"motion","update":7,"pair":[0,1],"problem":"hull \"a\" not found"})");
}

TEST(AnswerFeed, TheProofOfAMotionIsForwarded) {
  v1::CheckCollisionResponse response;
  response.mutable_first_contact()->add_intervals()->set_until(0.5);
  response.mutable_certificate()->mutable_direction()->set_x(3);
  v1::PieceCertificate* const piece = response.add_piece_certificates();
  piece->set_piece_b(4);
  response.add_piece_hulls()->set_hull_id("leg");
  const std::string message = MotionAnswerJson({{0, 1}, {}, {}, 7}, response);
  EXPECT_THAT(message, HasSubstr(R"("intervals":[{"until":0.5}])"));
  EXPECT_THAT(message, HasSubstr(R"("certificate":{"direction":{"x":3,"y":0,"z":0},"pairs":[]})"));
  EXPECT_THAT(message, HasSubstr(R"("pieceCertificates":[{"pieceA":0,"pieceB":4)"));
  EXPECT_THAT(message, HasSubstr(R"("hulls":[{"hullId":"leg")"));
}

}  // namespace answer_feed_test
}  // namespace hulld
