#ifndef HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/protocol.h"

namespace hulld {

// Changes hulls as one page asks, in its order, on a thread of its own, and tells the page how each
// change ended; what became of the hull comes with the watch that follows it. Any thread may call
// it. For `hullctl view --edit` alone.
class EditFeed {
 public:
  EditFeed(const Client& client, std::shared_ptr<PageChannel> page);
  // Waits for the change that is under way; those behind it are dropped.
  ~EditFeed();

  void Ask(ViewEdit edit);

 private:
  void Run();

  const Client& client_;
  const std::shared_ptr<PageChannel> page_;

  std::mutex mutex_;
  std::condition_variable changed_;
  // The rest is guarded by the mutex.
  std::deque<ViewEdit> edits_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_
