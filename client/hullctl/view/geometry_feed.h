#ifndef HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/protocol.h"
#include "client/hullctl/view/view_scene.h"

namespace hulld {

using ShapeFiles = std::vector<std::shared_ptr<const FileShape>>;

// Sends the shapes that a page requests, in order, on its own thread. The destructor waits for the
// shape being sent and drops the remaining requests. Thread-safe.
class GeometryFeed {
 public:
  GeometryFeed(const Client& client, std::shared_ptr<PageChannel> page);
  GeometryFeed(const GeometryFeed&) = delete;
  GeometryFeed& operator=(const GeometryFeed&) = delete;

  // Switches to another scene; drops pending requests.
  void Show(const ShapeFiles& files);
  void Request(const std::vector<ShapeRequest>& shapes);

 private:
  void Run(const std::stop_token& stop);

  const Client& client_;
  const std::shared_ptr<PageChannel> page_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  // Guarded by the mutex: the files of the scene, and the pending requests.
  std::shared_ptr<const ShapeFiles> files_ = std::make_shared<ShapeFiles>();
  std::deque<ShapeRequest> waiting_;
  // Stopped and joined first.
  std::jthread thread_;
};

// Returns the frame for a request. For a body, `pieces`, unless null, receives the IDs of its
// hulls.
std::string FrameFor(const Client& client, const ShapeFiles& files, const ShapeRequest& shape,
                     std::vector<std::string>* pieces = nullptr);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_GEOMETRY_FEED_H_
