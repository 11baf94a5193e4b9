#ifndef HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/ordered_worker.h"
#include "client/hullctl/view/protocol.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

using ShapeFiles = std::vector<std::shared_ptr<const FileShape>>;

// Sends the shapes that one page asks for, in its order, on a thread of its own. Any thread may
// call it.
class GeometryFeed {
 public:
  GeometryFeed(const Client& client, std::shared_ptr<PageChannel> page);

  // Another scene: forgets what was wished for and not sent.
  void Show(const ShapeFiles& files);
  void Ask(const std::vector<GeometryWish>& wishes);

 private:
  struct Order {
    GeometryWish wish;
    // The files of the scene that the wish is about.
    std::shared_ptr<const ShapeFiles> files;
  };

  std::mutex mutex_;
  // Guarded by the mutex.
  std::shared_ptr<const ShapeFiles> files_;
  const std::shared_ptr<PageChannel> page_;
  // Waits for the shape that is under way.
  OrderedWorker<Order> worker_;
};

// The frame that answers a wish. For a body, `pieces`, unless null, gets the IDs of its hulls.
std::string FrameFor(const Client& client, const ShapeFiles& files, const GeometryWish& wish,
                     std::vector<std::string>* pieces = nullptr);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_
