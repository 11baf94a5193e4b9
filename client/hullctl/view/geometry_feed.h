#ifndef HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/protocol.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

using ShapeFiles = std::vector<std::shared_ptr<const FileShape>>;

// Sends the shapes that one page asks for, in its order, on a thread of its own. Any thread may
// call it.
class GeometryFeed {
 public:
  GeometryFeed(const Client& client, std::shared_ptr<PageChannel> page);
  // Waits for the shape that is under way.
  ~GeometryFeed();

  // Another scene: forgets what was wished for and not sent.
  void Show(const ShapeFiles& files);
  void Ask(const std::vector<GeometryWish>& wishes);

 private:
  void Run();

  const Client& client_;
  const std::shared_ptr<PageChannel> page_;

  std::mutex mutex_;
  std::condition_variable changed_;
  // The rest is guarded by the mutex.
  ShapeFiles files_;
  std::deque<GeometryWish> wishes_;
  bool ended_ = false;
  std::thread thread_;
};

// The frame that answers a wish.
std::string FrameFor(const Client& client, const ShapeFiles& files, const GeometryWish& wish);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_
