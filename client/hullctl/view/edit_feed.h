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

// Pending edits. Edits of a hull keep their order. An edit of the same kind as the last pending one
// of its hull is merged into it: points are appended together, and repeated deletes become one.
// Hulls take turns in the order of their oldest edits. Not thread-safe.
class EditQueue {
 public:
  // Maximum number of pending coordinates, about 100 MB. A message of a page has at most 4 MiB
  // (BridgeOptions::max_message_bytes). Not tuned.
  static constexpr size_t kMaxNumbers = size_t{12} << 20;

  // Returns true if the edit was accepted: the queue had room.
  [[nodiscard]] bool Add(ViewEdit edit);
  bool empty() const { return edits_.empty(); }
  // Requires a nonempty queue.
  ViewEdit Take();

 private:
  using Edits = std::list<ViewEdit>;

  // Size of an edit, with a minimum for edits without points.
  static size_t NumbersOf(const ViewEdit& edit) { return edit.points.size() + 64; }

  Edits edits_;
  // The last pending edit of each hull.
  std::unordered_map<std::string, Edits::iterator> last_;
  size_t numbers_ = 0;
};

// Applies the edits of a page on its own thread, those of each hull in order, and reports the
// result of each edit to the page. The page receives the changed hull through the watch. Pending
// edits may be merged (EditQueue). Thread-safe. Only for `hullctl view --edit`.
class EditFeed {
 public:
  EditFeed(const Client& client, std::shared_ptr<PageChannel> page);
  // Applies the pending edits, because a user who closes the page still wants them.
  ~EditFeed();
  EditFeed(const EditFeed&) = delete;
  EditFeed& operator=(const EditFeed&) = delete;

  // Does not wait. If the queue is full, reports it to the page.
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
