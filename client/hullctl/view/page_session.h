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
#include "client/hullctl/view/edit_feed.h"
#include "client/hullctl/view/geometry_feed.h"
#include "client/hullctl/view/hull_follower.h"
#include "client/hullctl/view/protocol.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

// What all pages see; must outlive them.
struct ViewProgram {
  Client client;
  std::string server;
  // "x", "y" or "z".
  std::string up;
  // Whether pages may change hulls.
  bool edit = false;
  // At least one; pages start with the first.
  std::vector<ViewScene> scenes;
  // Told the key of each scene that a page starts to show; may be empty.
  std::function<void(const std::string&)> on_show;
};

std::string HelloMessage(const ViewProgram& program);

// One page: takes what it asks to the feeds that answer it.
class PageSession final : public PageHandler {
 public:
  PageSession(const ViewProgram& program, std::shared_ptr<PageChannel> page);
  ~PageSession() override;

  void OnMessage(std::string_view json) override;

 private:
  void Show(const std::string& key);
  void Edit(ViewEdit edit);
  // Tells of these from now on, as of the objects: pieces of bodies.
  void FollowToo(const std::vector<GeometryWish>& wishes);
  // Instead of what was followed.
  void Follow(v1::WatchHullsRequest request);
  // Called by the thread of the follower of scene number `scene`.
  void TakeHull(uint64_t scene, const v1::HullEvent& event, bool synced);

  const ViewProgram& program_;
  const std::shared_ptr<PageChannel> page_;
  AnswerFeed answers_;
  GeometryFeed geometry_;
  // Null unless pages may change hulls.
  const std::unique_ptr<EditFeed> edits_;

  std::mutex mutex_;
  // Guarded by the mutex: which scene is on show, counted, and what of it is known by ID.
  uint64_t scene_ = 0;
  std::vector<std::string> prefixes_;
  std::unordered_set<std::string> known_;

  // What the last follower watches.
  v1::WatchHullsRequest watched_;
  // Last: their threads use the others. The last one follows the scene on show; those before it
  // were cancelled. The bridge's thread must not wait for them, as they may wait for it to send.
  std::vector<std::unique_ptr<HullFollower>> followers_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_PAGE_SESSION_H_
