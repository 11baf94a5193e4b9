#ifndef HULLD_CLIENT_HULLCTL_VIEW_ANSWER_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_ANSWER_FEED_H_

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/protocol.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// A pair of a scene's objects, by index, and the number of the page's update that it belongs to.
struct ViewedPair {
  std::pair<uint32_t, uint32_t> indices;
  const ViewObject& a;
  const ViewObject& b;
  uint64_t update = 0;
};

// Answers the queries of a page on its own thread. Queries that arrive while one is in flight are
// merged, and the latest poses win, because the pointer moves faster than answers arrive. While the
// server is unreachable, repeats the last query every second.
// The destructor waits for the answer in flight. Thread-safe.
class AnswerFeed {
 public:
  AnswerFeed(const Client& client, std::shared_ptr<PageChannel> page);

  // Switches to another scene, by number; drops objects and queries.
  void Show(const ViewScene& scene, uint64_t number);
  // Ignored if they belong to another scene.
  void AddObjects(const std::vector<ViewObject>& objects, uint64_t scene);
  // Ignored if it belongs to another scene.
  void Request(const ViewQuery& query);
  // Answers the last query again because a hull changed.
  void HullsChanged();

 private:
  // The complete query.
  struct Query {
    // Requires a pair.
    ViewedPair Viewed() const {
      return {*pair, objects[pair->first], objects[pair->second], update};
    }

    std::vector<ViewObject> objects;
    v1::FindCollisionsRequest rules;
    std::optional<std::vector<uint32_t>> pairs;
    std::optional<std::pair<uint32_t, uint32_t>> pair;
    double tolerance = 0;
    bool certificate = false;
    uint64_t update = 0;
    bool rest = true;
    // True if the last attempt found the server unreachable, and the page has that error.
    bool is_repeated = false;
    // True if a hull or the scene changed since the last answer about the motion.
    bool motion_is_stale = true;
  };

  void Run(const std::stop_token& stop);
  // Sends the message of an error, unless a repeated query finds the server still unreachable: the
  // page has that message. Returns false if the page has closed.
  bool SendError(const Query& query, const absl::Status& status, const std::string& message);
  // Sends the answer about the pair. Returns false if the page has closed.
  bool AnswerPair(const Query& query);
  absl::StatusOr<std::string> MovingAnswer(const ViewedPair& pair, bool certificate);
  absl::StatusOr<std::string> RestingAnswer(const Query& query) const;
  // Returns the pair's answer with the tolerance, as JSON.
  absl::StatusOr<std::string> TolerantAnswer(const ViewedPair& pair, double tolerance) const;
  // Sends the first contact of the pair, if it moves, unless the page has it.
  bool AnswerMotion(const Query& query);
  bool AnswerScene(const Query& query);

  const Client& client_;
  const std::shared_ptr<PageChannel> page_;

  // Used by the thread only: the stream of a pair, its hulls or bodies, and true if it returns
  // certificates.
  std::unique_ptr<CollisionStream> stream_;
  std::pair<std::string, std::string> streamed_hulls_;
  bool streamed_certificate_ = false;
  v1::HullVersion streamed_version_a_;
  v1::HullVersion streamed_version_b_;
  // The pair and the request of the last query about a motion; empty if there was none.
  std::string queried_motion_;
  // The last query failed because the server was unreachable.
  bool is_unreachable_ = false;

  std::mutex mutex_;
  std::condition_variable_any changed_;
  // Guarded by the mutex, like all members below.
  Query query_;
  uint64_t scene_ = 0;
  bool is_requested_ = false;
  // Stopped and joined first.
  std::jthread thread_;
};

// Returns all data shown about a pair, from one query; tolerant_json: its member `tolerant`
// (protocol.h), or empty.
std::string PairAnswerJson(const ViewedPair& pair, const v1::CheckCollisionResponse& response,
                           const std::string& tolerant_json = "");

// Returns the request for that answer, with or without a proof.
v1::CheckCollisionRequest PairRequest(const ViewObject& a, const ViewObject& b, bool certificate);

// Returns the request for the first contact of a pair, with or without a proof; nothing if neither
// moves.
std::optional<v1::CheckCollisionRequest> MotionRequest(const ViewObject& a, const ViewObject& b,
                                                       bool certificate);

// Returns the message `motion` for its response or error.
std::string MotionAnswerJson(const ViewedPair& pair,
                             const absl::StatusOr<v1::CheckCollisionResponse>& response);

// Returns the message `collisions` for a scene; rules, pairs: as in ViewScene.
absl::StatusOr<std::string> SceneAnswerJson(const Client& client,
                                            const v1::FindCollisionsRequest& rules,
                                            const std::optional<std::vector<uint32_t>>& pairs,
                                            const std::vector<ViewObject>& objects,
                                            double tolerance, uint64_t update);

// Returns true if a pair of the scene collides.
absl::StatusOr<bool> AnyCollides(const Client& client, const v1::FindCollisionsRequest& rules,
                                 const std::optional<std::vector<uint32_t>>& pairs,
                                 const std::vector<ViewObject>& objects);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_ANSWER_FEED_H_
