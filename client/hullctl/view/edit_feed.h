#ifndef HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_

#include <condition_variable>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/protocol.h"

namespace hulld {

// Edits that wait. Those of one hull keep their order; an edit that is like the last one that waits
// for its hull joins it: points are appended together, and deleting twice is deleting once. Hulls
// take turns in the order of their oldest edits. Not thread-safe.
class EditQueue {
 public:
  // At most this many numbers of points wait, about 100 MB. A choice: a page sends 4 MiB at a time
  // at most (BridgeOptions::max_message_bytes).
  static constexpr size_t kMostNumbers = size_t{12} << 20;

  // Whether it was taken: there is room for it.
  [[nodiscard]] bool Add(ViewEdit edit);
  bool empty() const { return edits_.empty(); }
  // Requires that it is not empty.
  ViewEdit Take();

 private:
  using Edits = std::list<ViewEdit>;

  // What an edit counts, so that those without points count as well.
  static size_t NumbersOf(const ViewEdit& edit) { return edit.points.size() + 64; }

  Edits edits_;
  // The last edit of each hull that has one.
  std::unordered_map<std::string, Edits::iterator> last_;
  size_t numbers_ = 0;
};

// Changes hulls as one page asks, each hull's changes in their order, on a thread of its own, and
// tells the page how each change ended; what became of the hull comes with the watch that follows
// it. Changes that wait may be made as one (EditQueue). Any thread may call it. For `hullctl view
// --edit` alone.
class EditFeed {
 public:
  EditFeed(const Client& client, std::shared_ptr<PageChannel> page);
  // Makes the changes that wait: a user who asked for them and closed the page meant them.
  ~EditFeed();
  EditFeed(const EditFeed&) = delete;
  EditFeed& operator=(const EditFeed&) = delete;

  // Does not wait. The page is told where too much waits already to take this one.
  void Ask(ViewEdit edit);

 private:
  void Run();

  const Client& client_;
  const std::shared_ptr<PageChannel> page_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by the mutex.
  EditQueue waiting_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_
