#ifndef HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_
#define HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_

#include <memory>
#include <utility>

#include "client/client.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/ordered_worker.h"
#include "client/hullctl/view/protocol.h"

namespace hulld {

// Changes hulls as one page asks, in its order, on a thread of its own, and tells the page how each
// change ended; what became of the hull comes with the watch that follows it. Any thread may call
// it. For `hullctl view --edit` alone.
class EditFeed {
 public:
  EditFeed(const Client& client, std::shared_ptr<PageChannel> page);

  void Ask(ViewEdit edit) { worker_.Ask(std::move(edit)); }

 private:
  // Waits for the change that is under way; those behind it are dropped.
  OrderedWorker<ViewEdit> worker_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_EDIT_FEED_H_
