#ifndef HULLD_CLIENT_HULLCTL_VIEW_PAGE_SESSION_H_
#define HULLD_CLIENT_HULLCTL_VIEW_PAGE_SESSION_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_set>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/answer_feed.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/geometry_feed.h"
#include "client/hullctl/view/hull_follower.h"
#include "client/hullctl/view/protocol.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// State shared by all pages; must outlive them.
struct ViewProgram {
  Client client;
  std::string server;
  // "x", "y", or "z".
  std::string up;
  // At least one; pages start with the first.
  std::vector<ViewScene> scenes;
  // Receives the key of each scene that a page starts to show; may be empty.
  std::function<void(const std::string&)> on_show;
};

std::string HelloMessage(const ViewProgram& program);

// One page: passes its messages to the feeds that answer them.
class PageSession final : public PageHandler {
 public:
  PageSession(const ViewProgram& program, std::shared_ptr<PageChannel> page);
  ~PageSession() override;

  void OnMessage(std::string_view json) override;

 private:
  void Show(const std::string& key);
  void MoveJoints(const ViewConfiguration& configuration);
  // Also follows these pieces of bodies from now on.
  void WidenWatch(const std::vector<ShapeRequest>& shapes);
  // Replaces the current watch.
  void Follow(v1::WatchHullsRequest request);
  // Called by the thread of the follower of scene number `scene`.
  void TakeHull(uint64_t scene, const v1::HullEvent& event, bool synced);

  const ViewProgram& program_;
  const std::shared_ptr<PageChannel> page_;
  AnswerFeed answers_;
  GeometryFeed geometry_;

  std::mutex mutex_;
  // Guarded by the mutex: the number of the current scene, and its known IDs.
  uint64_t scene_ = 0;
  std::vector<std::string> prefixes_;
  std::unordered_set<std::string> known_;

  // The current scene.
  const ViewScene* shown_ = nullptr;
  // Request of the last follower.
  v1::WatchHullsRequest watched_;
  // Declared last because their threads use the other members. The last one follows the current
  // scene; earlier ones are cancelled. The bridge's thread must not wait for them because they may
  // wait for it to send.
  std::vector<std::unique_ptr<HullFollower>> followers_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_PAGE_SESSION_H_
