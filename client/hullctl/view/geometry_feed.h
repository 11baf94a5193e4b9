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

// Sends the shapes requested by one page, in order, on its own thread. Thread-safe.
class GeometryFeed {
 public:
  GeometryFeed(const Client& client, std::shared_ptr<PageChannel> page);

  // Switches to another scene; drops pending requests.
  void Show(const ShapeFiles& files);
  void Ask(const std::vector<ShapeRequest>& shapes);

 private:
  struct Order {
    ShapeRequest shape;
    // Files of the scene of the request.
    std::shared_ptr<const ShapeFiles> files;
  };

  std::mutex mutex_;
  // Guarded by the mutex.
  std::shared_ptr<const ShapeFiles> files_;
  const std::shared_ptr<PageChannel> page_;
  // Its destructor waits for the shape in flight.
  OrderedWorker<Order> worker_;
};

// Returns the frame for a request. For a body, `pieces`, unless null, receives the IDs of its
// hulls.
std::string FrameFor(const Client& client, const ShapeFiles& files, const ShapeRequest& shape,
                     std::vector<std::string>* pieces = nullptr);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_
