#ifndef HULLD_CLIENT_HULLCTL_VIEW_ANSWER_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_ANSWER_FEED_H_

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/protocol.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// Answers the questions of one page on a thread of its own. While one is being answered, those that
// come become one, and the latest poses win: a hand moves faster than answers travel. Any thread
// may call it.
class AnswerFeed {
 public:
  AnswerFeed(const Client& client, std::shared_ptr<PageChannel> page);
  // Waits for the answer that is under way.
  ~AnswerFeed();

  // Another scene, by its number: forgets objects and questions.
  void Show(const ViewScene& scene, uint64_t number);
  // Passed over when they are of another scene.
  void AddObjects(const std::vector<ViewObject>& objects, uint64_t scene);
  // Passed over when it is about another scene.
  void Ask(const ViewQuestion& question);
  // Some hull changed: the last question is answered anew.
  void HullsChanged();

 private:
  // What is asked, as a whole.
  struct Question {
    std::vector<ViewObject> objects;
    v1::FindCollisionsRequest rules;
    std::optional<std::pair<uint32_t, uint32_t>> pair;
    double tolerance = 0;
    bool certificate = false;
    uint64_t update = 0;
    bool rest = true;
    bool hulls_changed = false;
  };

  void Run();
  // What became of the pair. False when the page has gone.
  bool AnswerPair(const Question& question);
  absl::StatusOr<std::string> MovingAnswer(const Question& question);
  absl::StatusOr<std::string> RestingAnswer(const Question& question) const;
  // What the tolerance makes of the pair, as JSON.
  absl::StatusOr<std::string> TolerantAnswer(const Question& question) const;
  bool AnswerScene(const Question& question) const;

  const Client& client_;
  const std::shared_ptr<PageChannel> page_;

  // Used by the thread alone: the stream of a pair, which hulls or bodies it is of, and whether it
  // tells certificates.
  std::unique_ptr<CollisionStream> stream_;
  std::pair<std::string, std::string> streamed_hulls_;
  bool streamed_certificate_ = false;
  v1::HullVersion streamed_version_a_;
  v1::HullVersion streamed_version_b_;

  std::mutex mutex_;
  std::condition_variable changed_;
  // The rest is guarded by the mutex.
  Question question_;
  uint64_t scene_ = 0;
  bool asked_ = false;
  bool ended_ = false;
  std::thread thread_;
};

// All that a page shows of a pair, from the answer to one question; tolerant_json: its member
// `tolerant` (protocol.h), or empty.
std::string PairAnswerJson(std::pair<uint32_t, uint32_t> pair, const ViewObject& a,
                           const ViewObject& b, uint64_t update,
                           const v1::CheckCollisionResponse& response,
                           const std::string& tolerant_json = "");

// What is wanted for that, with or without what proves it.
v1::CheckCollisionRequest PairRequest(const ViewObject& a, const ViewObject& b, bool certificate);

// The message `collisions` for a scene.
absl::StatusOr<std::string> SceneAnswerJson(const Client& client,
                                            const v1::FindCollisionsRequest& rules,
                                            const std::vector<ViewObject>& objects,
                                            double tolerance, uint64_t update);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_ANSWER_FEED_H_
